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


def beyond(cue: SightingCue, now: State, trust: float | None = None) -> np.ndarray | None:
    """Return where it says that nothing is theirs, (h, w) bool, beside a map of some trust."""
    heat = None if trust is None else ShownHeat(np.zeros(SHAPE, np.uint8), 0, trust)
    view, pose = SimpleNamespace(now=now.frame, heat=heat), SimpleNamespace(height=HEIGHT)
    blank = np.zeros(SHAPE, np.float32)
    body, area = np.zeros(SHAPE, np.uint8), 0.2
    given = CueInput(view, [now], pose, WINDOW, body, blank, True, area, TrackingConfig())
    found = cue.evidence(given)
    return None if found is None else found.logit < -1


@pytest.mark.parametrize('way', [(0, 0), (25, -4), (-80, 0)])
def test_what_is_beyond_the_box_is_not_theirs_wherever_they_went_since(way) -> None:
    cue = SightingCue()
    assert beyond(cue, state(0)) is None
    cue.see(BOX, state(0).place)
    found = beyond(cue, state(400_000_000, way))
    # A tenth of their height about it may be theirs.
    left, top = 50 - 6 + way[0], 20 - 6 + way[1]
    inside = np.zeros(SHAPE, bool)
    inside[max(top, 0) : top + 72, max(left, 0) : max(left + 42, 0)] = True
    assert np.array_equal(found, ~inside)


def test_an_old_box_says_nothing() -> None:
    cue = SightingCue()
    cue.see(BOX, state(0).place)
    assert beyond(cue, state(800_000_000)) is None
    cue.see(BOX, state(700_000_000).place)
    assert beyond(cue, state(800_000_000)).any()


def test_a_box_says_nothing_where_a_trusted_map_shows_the_outline() -> None:
    cue = SightingCue()
    cue.see(BOX, state(0).place)
    assert beyond(cue, state(100_000_000), 0.9) is None
    assert beyond(cue, state(100_000_000), 0.1).any()


def test_it_is_known_where_the_detector_saw_a_person_last_if_it_did_of_late() -> None:
    boxes: list[Box] = []
    stays = Figure(120, RED)
    told = watched(boxes, period=5.0)
    told.start(stays)
    for number in range(25):
        seen = Box(stays.box.x - 9, stays.box.y, 50, 105)
        boxes[:] = [seen]
        told.show(stays)
        (track,) = told.tracker.tracks()
        box = track.detected_in(told.stamp_ns)
        # Looked once, at the first frames.
        if 3 <= number <= 15:
            assert box.iou(seen) > 0.9
        elif number > 20:
            assert box.iou(seen) < 0.8
