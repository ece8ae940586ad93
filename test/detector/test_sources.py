# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from types import SimpleNamespace

import numpy as np
import pytest

from gait_segmentation.detector.detection import Detection
from gait_segmentation.detector.networks import Networks
from gait_segmentation.detector.scheduler import Detections, DetectorScheduler
from gait_segmentation.detector.sources import Seen, Sources
from gait_segmentation.geometry import Box
from gait_segmentation.starting import StartingConfig
from test.tracking.figures import blind
from test.walkers import box_of, clip, small_bank


def looked(
    sources: Sources,
    image: np.ndarray,
    stamp_ns: int,
    since_ns: int = 0,
    unsure: tuple[Box, ...] = (),
) -> Seen:
    """Return what is said of a frame while nobody is tracked."""
    return sources.look(
        image, stamp_ns, boxes=True, bodies=([], []), urgent=True,
        small=lambda height: False, unsure=unsure, heat_map_age=0.0, since_ns=since_ns,
    )  # fmt: skip


def test_the_maps_of_another_film_are_trusted_or_not_by_themselves():
    sources = Sources(small_bank(), StartingConfig(), blind())
    for waiting in (True, False):
        trust = []
        for frame, inverted in zip(clip()[:2], (255, 0), strict=True):
            sources.add_heat_map(frame.masks[0] ^ inverted, frame.stamp_ns)
            trust.append(looked(sources, frame.image, frame.stamp_ns).heat.trust)
            sources.reset(waiting=waiting)
        assert trust == [0, 1]


@pytest.mark.parametrize('shift', [0, 60])
def test_a_region_of_a_map_where_somebody_is_detected_is_no_second_one(shift):
    frame = clip()[0]
    detected = [Detection(box_of(frame).shifted(shift, 0), 0.9)]
    networks = DetectorScheduler(networks=Networks(lambda image: detected))
    sources = Sources(small_bank(), StartingConfig(), networks)
    sources.add_heat_map(frame.masks[0], frame.stamp_ns)
    seen = looked(sources, frame.image, frame.stamp_ns)
    assert seen.people == tuple(detected)
    assert len(seen.by_map) == (shift > 0)


@pytest.mark.parametrize(('since_ns', 'says'), [(8 * 10**8, True), (10**9, False)])
def test_a_look_at_a_frame_of_which_nobodys_place_is_known_says_nothing(since_ns, says):
    frame, now_ns = clip()[0], 12 * 10**8
    late = Detections(9 * 10**8, (Detection(box_of(frame), 0.9),))
    scheduler = SimpleNamespace(look=lambda *_, **__: late, draw=None, reset=lambda: None)
    sources = Sources(small_bank(), StartingConfig(), scheduler)
    sources.add_heat_map(frame.masks[0], now_ns)
    seen = looked(sources, frame.image, now_ns, since_ns)
    assert (seen.people is not None) == says
    # Nor does it keep a map from telling of them.
    assert len(seen.by_map) == (not says)


def test_only_the_smaller_of_who_may_be_somebody_are_looked_at_closely():
    asked = []
    scheduler = SimpleNamespace(
        look=lambda *_, unsure, **__: asked.extend(unsure), draw=None, reset=lambda: None
    )
    small, tall = (Box(9, 9, 20, share * 320) for share in (0.19, 0.21))
    image = np.zeros((240, 320, 3), np.uint8)
    looked(Sources(small_bank(), StartingConfig(), scheduler), image, 1, unsure=(tall, small))
    assert asked == [small]
