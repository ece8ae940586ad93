# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Who gets which slot: first boxes, people found by their walk, and those found again."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from gait_segmentation.errors import InputError
from gait_segmentation.geometry import Box
from gait_segmentation.images import Window
from gait_segmentation.results import Feedback, TrackResult
from gait_segmentation.starting import StartingConfig
from test.tracking.figures import BLUE, GREEN, RED, Figure, Told, picture, walk


def ids(results: Sequence[TrackResult]) -> list[int]:
    return [result.track_id for result in results]


def test_every_slot_has_a_result() -> None:
    results = Told(slots=3).show(Figure(60))
    assert [(each.track_id, each.state, each.box) for each in results] == [(0, 'empty', None)] * 3
    assert not any(each.likelihood.any() for each in results)


def test_boxes_take_free_slots_in_order() -> None:
    told = Told(slots=3)
    people = (Figure(60), Figure(150, BLUE), Figure(240, GREEN))
    told.start(*people[:2])
    assert ids(told.show(*people)) == [1, 2, 0]
    told.start(people[2])
    assert ids(told.show(*people)) == [1, 2, 3]


def test_a_box_on_somebody_tracked_starts_that_slot_anew() -> None:
    told = Told(slots=2)
    told.start(Figure(60), Figure(200, BLUE))
    assert ids(told.show(Figure(60), Figure(200, BLUE))) == [1, 2]
    told.start(Figure(205, BLUE))
    assert ids(told.show(Figure(60), Figure(202, BLUE))) == [1, 3]


def test_without_a_free_slot_the_least_sure_is_replaced() -> None:
    told = Told(slots=2)
    people = [Figure(60), Figure(150, BLUE)]
    told.start(*people)
    told.show(*people)
    # The second stands behind a board.
    results = [told.show(*people, boards=[(125, 145)]) for _ in range(2)][-1]
    assert results[1].confidence < results[0].confidence
    told.start(Figure(250, GREEN))
    assert ids(told.show(*people, Figure(250, GREEN), boards=[(125, 145)])) == [1, 3]


def test_people_of_one_size_share_a_world_and_others_have_their_own() -> None:
    told = Told(slots=3, working_height=60)
    people = (
        Figure(50, height=130.0),
        Figure(140, BLUE, height=120.0),
        Figure(250, GREEN, height=60.0),
    )
    told.start(*people)
    told.show(*people)
    first, second, third = (target.world for target in told.tracker._targets())
    assert first is second
    assert third is not first
    told.tracker.reset()
    assert told.tracker._worlds == []


def test_people_of_every_world_learn_from_their_masks() -> None:
    told = Told(slots=2, working_height=60)
    people = (Figure(50, height=130.0), Figure(250, GREEN, height=60.0))
    told.start(*people)
    for _ in range(3):
        told.show(*people)
    worlds = [target.world for target in told.tracker._targets()]
    assert worlds[0] is not worlds[1]
    assert [len(world.pending) for world in worlds] == [0, 0]


def test_one_bad_box_is_refused_and_the_others_start() -> None:
    told = Told(slots=2)
    told.tracker.initialize(Box(500, 10, 20, 50))
    told.start(Figure(60))
    with pytest.raises(InputError, match='outside of the image'):
        told.show(Figure(60))
    assert ids(told.show(Figure(60))) == [1, 0]


def test_feedback_must_be_of_one_frame() -> None:
    told = Told(slots=2)
    told.start(Figure(60), Figure(200, BLUE))
    one, two = told.show(Figure(60), Figure(200, BLUE))
    mask = np.zeros((180, 320), np.uint8)
    pair = [
        Feedback(one.stamp_ns, 1, mask, None, mask),
        Feedback(two.stamp_ns + 1, 2, mask, None, mask),
    ]
    with pytest.raises(InputError, match='one frame'):
        told.tracker.learn(pair)


class Finder:
    """Finds whom it is told to, and remembers when it was asked."""

    def __init__(self) -> None:
        self.boxes: list[Box] = []
        self.asked: list[list[Box]] = []

    def update(self, image: np.ndarray, stamp_ns: int, occupied: Sequence[Box]) -> list[Box]:
        self.asked.append(list(occupied))
        found, self.boxes = self.boxes, []
        return found

    def recall(self, stamp_ns: int, now: np.ndarray, window: Window) -> None:
        """Remember nothing of the place."""

    def find(self, figure: Figure) -> None:
        box = Box.around(figure.mask())
        assert box is not None
        self.boxes.append(box)

    def reset(self) -> None:
        self.asked.append([])


@pytest.fixture
def finder() -> Finder:
    return Finder()


def finding(finder: Finder, slots: int = 1, **options) -> Told:
    told = Told(slots, 'motion', **options)
    told.tracker._finder = finder
    return told


def test_people_found_get_free_slots_and_are_told_to_the_finder(finder: Finder) -> None:
    told = finding(finder, 2)
    assert ids(told.show(Figure(60))) == [0, 0]
    finder.find(Figure(60))
    assert ids(told.show(Figure(60))) == [1, 0]
    told.show(Figure(60))
    (occupied,) = finder.asked[-1]
    found = Box.around(Figure(60).mask())
    assert found is not None
    assert occupied.iou(found) > 0.7


def test_nobody_is_looked_for_without_a_free_slot(finder: Finder) -> None:
    told = finding(finder)
    finder.find(Figure(60))
    told.show(Figure(60))
    count = len(finder.asked)
    told.show(Figure(60))
    assert len(finder.asked) == count


def test_nobody_is_looked_for_once_boxes_are_given_until_a_reset(finder: Finder) -> None:
    told = finding(finder, 2)
    told.start(Figure(60))
    told.show(Figure(60))
    assert finder.asked == []
    told.tracker.reset()
    told.show(Figure(60))
    assert finder.asked[-1] == []
    assert len(finder.asked) == 2


def test_the_search_can_be_switched_off_and_on() -> None:
    told = Told(1, 'off')
    assert told.tracker._finder is None
    told.tracker.starting = StartingConfig(auto_init='motion')
    assert told.tracker._finder is not None


def test_a_box_that_is_refused_does_not_end_the_search(finder: Finder) -> None:
    told = finding(finder)
    told.tracker.initialize(Box(500, 10, 20, 50))
    with pytest.raises(InputError):
        told.show(Figure(60))
    finder.find(Figure(60))
    assert ids(told.show(Figure(60))) == [1]


@pytest.mark.parametrize(('coat', 'track_id'), [(RED, 1), (GREEN, 2)])
def test_somebody_found_is_the_lost_one_only_in_the_same_clothes(
    finder: Finder, coat: tuple[int, int, int], track_id: int
) -> None:
    told = finding(finder, patience=5.0)
    out = walk(Figure(260), 25, 4.0)
    finder.find(out[0])
    for figure in out:
        (result,) = told.show(figure)
    for _ in range(5):
        (result,) = told.show()
    assert (result.state, result.track_id) == ('lost', 1)
    # Far from where the first has left.
    finder.find(Figure(60, coat))
    (result,) = told.show(Figure(60, coat))
    assert (result.state, result.track_id) == ('tracked', track_id)


def test_pictures_have_the_masks_they_say() -> None:
    image, (far, near) = picture([Figure(100), Figure(110, BLUE)])
    assert image.shape == (180, 320, 3)
    assert not ((far > 0) & (near > 0)).any()
    assert 0 < (far > 0).sum() < (near > 0).sum()
