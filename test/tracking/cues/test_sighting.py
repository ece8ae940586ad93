# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from gait_segmentation.geometry import Box
from gait_segmentation.tracking import TrackingConfig
from gait_segmentation.tracking.cues import CueInput
from gait_segmentation.tracking.cues.sighting import SightingCue, recognize
from gait_segmentation.tracking.track import State
from test.tracking.figures import BLUE, RED, Figure, picture, watched

SHAPE = (100, 160)
WINDOW = (slice(20, 120), slice(30, 190))
HEIGHT = 60.0
BOX = Box(80, 40, 30, 60)


def state(
    stamp_ns: int, displacement: tuple[float, float] = (0.0, 0.0), trust: float | None = None
) -> State:
    """Return the state of a track in a frame, which has a heat map if that is trusted so far."""
    heat = None if trust is None else np.zeros(SHAPE, np.uint8)
    image = SimpleNamespace(stamp_ns=stamp_ns)
    return State(SimpleNamespace(image=image, heat=heat, heat_trust=trust or 0.0), displacement)


def beyond(cue: SightingCue, now: State) -> np.ndarray | None:
    """Return where a cue says that nothing is the person's, (h, w) bool of the window."""
    view, pose = SimpleNamespace(now=now.frame), SimpleNamespace(height=HEIGHT)
    blank = np.zeros(SHAPE, np.float32)
    body, area = np.zeros(SHAPE, np.uint8), 0.2
    given = CueInput(view, [now], pose, WINDOW, body, blank, True, area, TrackingConfig())
    found = cue.evidence(given)
    return None if found is None else found.logit < -1


@pytest.mark.parametrize('way', [(0, 0), (25, -4), (-80, 0)])
def test_what_is_beyond_the_box_is_not_theirs_wherever_they_went_since(way) -> None:
    cue = SightingCue()
    assert beyond(cue, state(0)) is None
    cue.see(BOX, state(0))
    found = beyond(cue, state(400_000_000, way))
    # A tenth of their height about it may be theirs.
    left, top = 50 - 6 + way[0], 20 - 6 + way[1]
    inside = np.zeros(SHAPE, bool)
    inside[max(top, 0) : top + 72, max(left, 0) : max(left + 42, 0)] = True
    assert np.array_equal(found, ~inside)


def test_an_old_box_says_nothing() -> None:
    cue = SightingCue()
    cue.see(BOX, state(0))
    assert beyond(cue, state(800_000_000)) is None
    cue.see(BOX, state(700_000_000))
    assert beyond(cue, state(800_000_000)).any()


def test_a_box_says_nothing_where_a_trusted_map_shows_the_outline() -> None:
    cue = SightingCue()
    cue.see(BOX, state(0))
    assert beyond(cue, state(100_000_000, trust=0.9)) is None
    assert beyond(cue, state(100_000_000, trust=0.1)).any()


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


OWN, OTHER = Box(50, 50, 40, 100), Box(150, 50, 40, 100)


def recognized(people: list[Box], seen: list[Box]) -> list[tuple[int, int]]:
    return recognize([(box, box) for box in people], seen)


def test_a_detection_is_theirs_if_each_is_the_best_match_of_the_other() -> None:
    here, there = OWN.shifted(4, -2), OTHER.shifted(4, -2)
    assert recognized([OWN, OTHER], [there, here]) == [(0, 1), (1, 0)]
    # Two tracks, one of which is hidden.
    assert recognized([OWN, OWN.shifted(9, 0)], [here]) == [(0, 0)]
    assert recognized([OWN], [OTHER]) == recognized([OWN], []) == recognized([], []) == []


def share_of_the_cabinet(*, neighbour: bool = False, **tracking) -> float:
    """Return how much of a cabinet is taken, which was in the masks of somebody until now."""
    boxes: list[Box] = []
    stays, cabinet = Figure(120, RED), (148, 172)
    told = watched(boxes, **tracking)
    told.tracker.initialize(Box(stays.box.x, stays.box.y, cabinet[1] - stays.box.x, 98))
    others = [Figure(250, BLUE)] if neighbour else []
    likely = np.zeros(0)
    for number in range(16):
        image, (*_, own) = picture([*others, stays])
        image[60:140, slice(*cabinet)] = RED
        if number < 8:
            own[60:140, slice(*cabinet)] = 255
        else:
            # As a cut of the likelihood would.
            own = np.where(likely > 127, np.uint8(255), np.uint8(0))
        boxes[:] = [figure.box for figure in (*others, stays) if number >= 8]
        (result,) = told.see(image, [own])
        likely = cv2.resize(result.likelihood, image.shape[1::-1])
    return float((likely[60:140, slice(*cabinet)] > 127).mean())


def test_a_cabinet_that_was_taken_in_is_let_go_once_the_detector_sees_them() -> None:
    assert share_of_the_cabinet(use_sightings=False) > 0.5
    assert share_of_the_cabinet() < 0.2
    assert share_of_the_cabinet(neighbour=True) < 0.2
