# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from types import SimpleNamespace

import numpy as np
import pytest

from gait_segmentation.starting.blobs import BodyShapes
from gait_segmentation.tracking.map_witness import MapWitness
from test.tracking.figures import Figure, Told, picture
from test.walkers import small_bank

SHAPES = BodyShapes(small_bank())
BODY = Figure(100).mask()
ALL = slice(0, BODY.shape[0]), slice(0, BODY.shape[1])
WRONG = np.zeros_like(BODY)
"""A mask that has the legs, and a cupboard beside them."""
WRONG[80:140, 60:130] = 255


def witness(
    frames: int, heat: np.ndarray | None = BODY, mask: np.ndarray = WRONG, **changes
) -> MapWitness:
    """Return a witness of some frames with a map and another mask."""
    made = MapWitness(SHAPES)
    frame = {'heat': heat, 'heat_frames': 0, 'heat_trust': 1.0} | changes
    height = frame.pop('height', 100.0)
    for _ in range(frames):
        made.see(SimpleNamespace(**frame), mask, ALL, height)
    return made


def test_a_map_that_shows_a_body_overrules_other_masks_after_eight_frames_in_a_row() -> None:
    made = witness(7)
    assert not made.overrules
    frame = SimpleNamespace(heat=BODY, heat_frames=0, heat_trust=1.0)
    made.see(frame, BODY, ALL, 100.0)
    assert made.box is None
    for number in range(8):
        assert not made.overrules, number
        made.see(frame, WRONG, ALL, 100.0)
    assert made.overrules
    assert made.box.iou(Figure(100).box) == 1


@pytest.mark.parametrize(
    'changes',
    [
        {'heat': None},
        {'heat_frames': 1},
        {'heat_trust': 0.9},
        {'height': 140.0},
        {'height': 70.0},
        {'heat': WRONG, 'mask': BODY, 'height': 60.0},
        {'heat': Figure(200).mask()},
    ],
    ids=['none', 'old', 'doubtful', 'too small', 'too tall', 'no body', 'another person'],
)
def test_no_other_map_does(changes: dict) -> None:
    assert witness(8).overrules
    assert not witness(20, **changes).overrules


def test_a_track_whose_mask_is_wrong_begins_anew_where_the_map_shows_a_body() -> None:
    told, results, figure = Told(), [], Figure(100)
    image, (mask,) = picture([figure])
    told.start(figure)
    for _ in range(10):
        told.tracker.add_heat_map(mask, told.stamp_ns)
        results += told.see(image, [WRONG])
    assert [(each.state, each.track_id) for each in results] == [('tracked', 1)] * 10
    *before, then, anew = results
    assert [each.reason for each in before] == [''] * 8
    assert 'heat map' in then.reason
    assert then.box.iou(figure.box) < 0.7
    assert anew.box.iou(figure.box) > 0.85
    assert anew.reason == ''
