# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from types import SimpleNamespace

import pytest

from gait_segmentation.detector.detection import Detection
from gait_segmentation.detector.networks import Networks
from gait_segmentation.detector.scheduler import Detections, DetectorScheduler
from gait_segmentation.detector.sources import Sources
from gait_segmentation.starting import StartingConfig
from test.tracking.figures import blind
from test.walkers import box_of, clip, small_bank


def test_the_maps_of_another_film_are_trusted_or_not_by_themselves():
    sources = Sources(small_bank(), StartingConfig(), blind())
    for waiting in (True, False):
        trust = []
        for frame, inverted in zip(clip()[:2], (255, 0), strict=True):
            sources.add_heat_map(frame.masks[0] ^ inverted, frame.stamp_ns)
            seen = sources.look(
                frame.image, frame.stamp_ns, boxes=True, bodies=([], []), urgent=False,
                small=lambda height: False, heat_map_age=0.0, since_ns=0,
            )  # fmt: skip
            trust.append(seen.heat.trust)
            sources.reset(waiting=waiting)
        assert trust == [0, 1]


@pytest.mark.parametrize('shift', [0, 60])
def test_a_region_of_a_map_where_somebody_is_detected_is_no_second_one(shift):
    frame = clip()[0]
    detected = [Detection(box_of(frame).shifted(shift, 0), 0.9)]
    networks = DetectorScheduler(networks=Networks(lambda image: detected))
    sources = Sources(small_bank(), StartingConfig(), networks)
    sources.add_heat_map(frame.masks[0], frame.stamp_ns)
    seen = sources.look(
        frame.image, frame.stamp_ns, boxes=True, bodies=([], []), urgent=True,
        small=lambda height: False, heat_map_age=0.0, since_ns=0,
    )  # fmt: skip
    assert seen.people == tuple(detected)
    assert len(seen.by_map) == (shift > 0)


@pytest.mark.parametrize(('since_ns', 'says'), [(8 * 10**8, True), (10**9, False)])
def test_a_look_at_a_frame_of_which_nobodys_place_is_known_says_nothing(since_ns, says):
    late = Detections(9 * 10**8, (Detection(box_of(clip()[0]), 0.9),))
    scheduler = SimpleNamespace(look=lambda *_, **__: late, draw=None, reset=lambda: None)
    seen = Sources(small_bank(), StartingConfig(), scheduler).look(
        clip()[0].image, 12 * 10**8, boxes=True, bodies=([], []), urgent=True,
        small=lambda height: False, heat_map_age=0.0, since_ns=since_ns,
    )  # fmt: skip
    assert (seen.people is not None) == says
