# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from types import SimpleNamespace

import numpy as np
import pytest

from gait_segmentation.geometry import Box
from gait_segmentation.scene.scene import ShownHeat
from gait_segmentation.tracking import TrackingConfig
from gait_segmentation.tracking.cues import CueInput
from gait_segmentation.tracking.cues.sighting import SightingCue
from gait_segmentation.tracking.state import State
from test.tracking.figures import RED, Figure, watched

SHAPE = (100, 160)
WINDOW = (slice(20, 120), slice(30, 190))
HEIGHT = 60.0
BOX = Box(80, 40, 30, 60)


def state(stamp_ns: int, displacement: tuple[float, float] = (0.0, 0.0)) -> State:
    """Return the state of a track in a frame."""
    return State(SimpleNamespace(image=SimpleNamespace(stamp_ns=stamp_ns)), displacement)


def evidence(cue: SightingCue, now: State, trust: float | None = None) -> np.ndarray | None:
    """Return what it says of the window, (h, w) float32, beside a map of some trust."""
    heat = None if trust is None else ShownHeat(np.zeros(SHAPE, np.uint8), 0, trust)
    view = SimpleNamespace(now=now.frame, heat=heat, shape=(140, 220))
    pose = SimpleNamespace(height=HEIGHT)
    blank = np.zeros(SHAPE, np.float32)
    body, area = np.zeros(SHAPE, np.uint8), 0.2
    given = CueInput(view, [now], pose, WINDOW, body, blank, True, area, TrackingConfig())
    found = cue.evidence(given)
    return None if found is None else found.logit


def within(margin: float, way: tuple[int, int], sides: tuple[str, ...] = ()) -> np.ndarray:
    """Return what is so near to the box, (h, w) bool; of some sides everything."""
    here = BOX.shifted(way[0] - 30, way[1] - 20).padded(margin, margin)
    inside = np.zeros(SHAPE, bool)
    inside[
        0 if 'top' in sides else max(round(here.y), 0) : max(round(here.bottom), 0),
        0 if 'left' in sides else max(round(here.x), 0) : max(round(here.right), 0),
    ] = True
    return inside


@pytest.mark.parametrize('way', [(0, 0), (25, -4), (-70, 0)])
def test_the_farther_beyond_the_box_the_less_it_is_theirs_wherever_they_went_since(way) -> None:
    cue = SightingCue()
    assert evidence(cue, state(0)) is None
    cue.see(BOX, state(0))
    found = evidence(cue, state(400_000_000, way))
    assert (found[within(6, way)] == 0).all()
    assert (found[~within(15, way)] == -6).all()
    between = found[within(14, way) & ~within(7, way)]
    assert -6 < between.min() < -4 < -1 < between.max() < 0


@pytest.mark.parametrize(('way', 'sides'), [((-80, 0), ('left',)), ((0, -40), ('top',))])
def test_a_box_that_ends_at_the_border_says_nothing_of_that_side(way, sides) -> None:
    cue = SightingCue()
    cue.see(BOX, state(0))
    found = evidence(cue, state(400_000_000, way))
    assert (found[within(6, way, sides)] == 0).all()
    assert (found[~within(15, way, sides)] == -6).all()


def test_an_old_box_says_nothing() -> None:
    cue = SightingCue()
    cue.see(BOX, state(0))
    assert evidence(cue, state(800_000_000)) is None
    cue.see(BOX, state(700_000_000))
    assert evidence(cue, state(800_000_000)).any()


def test_a_box_says_nothing_where_a_trusted_map_shows_the_outline() -> None:
    cue = SightingCue()
    cue.see(BOX, state(0))
    assert evidence(cue, state(100_000_000), 0.9) is None
    assert evidence(cue, state(100_000_000), 0.1).any()


def test_a_person_is_sought_where_the_detector_saw_them_last_if_it_did_of_late() -> None:
    boxes: list[Box] = []
    stays = Figure(120, RED)
    told = watched(boxes, period=5.0)
    told.start(stays)
    for number in range(25):
        seen = Box(stays.box.x - 9, stays.box.y, 50, 105)
        boxes[:] = [seen]
        told.show(stays)
        (track,) = told.tracker.tracks()
        (sought, *more) = track.sought_in(told.stamp_ns)
        # Looked once, at the first frames.
        if 3 <= number <= 15:
            assert (sought.iou(seen) > 0.9, more) == (True, [])
        elif number > 20:
            assert (sought.iou(seen) < 0.8, len(more)) == (True, 1)
