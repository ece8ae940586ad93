# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Who gets which slot of those who are given by boxes."""

from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.errors import InputError
from gait_segmentation.geometry import Box
from gait_segmentation.results import Feedback
from test.tracking.figures import BLUE, GREEN, Figure, Told, ids


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
    for _ in range(2):
        told.show(*people)
    # Those of every world learn from their masks.
    assert [len(world.pending) for world in (first, third)] == [0, 0]
    told.tracker.reset()
    assert told.tracker._worlds == []


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
