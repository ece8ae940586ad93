# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest

from gait_segmentation.images import placed
from gait_segmentation.results import Feedback
from gait_segmentation.sizes import shrink
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.person.learning import (
    WholeArea,
    grown,
    working_masks,
)
from gait_segmentation.tracking.person.person import Person, new_colours

SHAPE = (60, 80)


def block(left: int, top: int, right: int, bottom: int) -> np.ndarray:
    mask = np.zeros(SHAPE, np.uint8)
    mask[top:bottom, left:right] = 255
    return mask


def someone(mask: np.ndarray) -> Person:
    return Person(1, 30, 30, 40, 8, 8, mask, *new_colours(TrackingConfig()))


def test_masks_come_at_working_size() -> None:
    mask = np.kron(block(20, 10, 40, 50), np.ones((2, 2), np.uint8))
    feedback = Feedback(1, 1, mask, None, mask)
    small, prior = working_masks(feedback, SHAPE)
    np.testing.assert_array_equal(small, block(20, 10, 40, 50))
    assert prior.shape == SHAPE


@pytest.mark.parametrize(('size', 'shape'), [((240, 320), SHAPE), ((90, 100), (61, 68))])
def test_masks_shrink_as_a_whole_image_would(
    size: tuple[int, int], shape: tuple[int, int]
) -> None:
    for place in ((10, 20), (0, 0), (size[0] - 1, size[1] - 1)):
        mask = np.zeros(size, np.uint8)
        cv2.ellipse(mask, place[::-1], (20, 31), 15, 0, 360, 255, -1)
        small, _ = working_masks(Feedback(1, 1, mask, None, mask), shape)
        expected = np.where(shrink(mask, shape) > 127, 255, 0)
        assert np.count_nonzero(small != expected) <= 2
    empty = np.zeros(size, np.uint8)
    assert not working_masks(Feedback(1, 1, empty, None, empty), shape)[0].any()


def test_the_margin_is_a_share_of_the_height() -> None:
    mask = block(20, 10, 40, 50)
    window, part = grown(mask, 100)
    margin = placed(part, window, SHAPE)
    assert np.flatnonzero(margin[30]).tolist() == list(range(18, 42))
    assert margin.any(axis=1).sum() == 44
    assert not grown(np.zeros(SHAPE, np.uint8), 100)[1].any()


def test_half_a_mask_is_not_whole() -> None:
    whole, half = block(20, 10, 40, 50), block(20, 10, 30, 50)
    person = someone(whole)
    area = WholeArea(person)
    assert area.update(whole, whole, person)
    assert not area.update(half, whole, person)
    assert area.update(block(20, 10, 40, 48), whole, person)


@pytest.mark.parametrize('near', [{'company': True}, {'alone': False}])
def test_two_bodies_in_a_mask_are_not_one_that_is_whole(near: dict[str, bool]) -> None:
    one, two = block(20, 10, 40, 50), block(20, 10, 50, 50)
    person = someone(one)
    area = WholeArea(person)
    assert area.update(one, one, person, **near)
    assert not area.update(two, one, person, **near)
    assert area.update(one, one, person, **near)
    # With nobody near it is of one person.
    assert area.update(two, one, person)


def test_a_first_mask_far_too_large_does_not_keep_others_out() -> None:
    true = block(20, 10, 40, 50)
    person = someone(block(5, 5, 55, 55))
    area = WholeArea(person)
    assert not area.update(true, true, person, alone=False)
    assert not area.update(true, np.zeros_like(true), person)
    for _ in range(10):
        assert area.update(true, true, person)
    assert area.update(true, true, person, alone=False)
    assert not area.update(block(20, 10, 40, 30), true, person)


def test_later_a_template_that_fits_what_is_seen_does_not_make_it_whole() -> None:
    whole, half = block(20, 10, 40, 50), block(20, 10, 30, 50)
    person = someone(whole)
    area = WholeArea(person)
    for _ in range(40):
        assert area.update(whole, whole, person)
    assert not area.update(half, half, person)


def test_half_a_body_behind_something_known_teaches_no_size() -> None:
    whole, half = block(20, 10, 40, 50), block(20, 10, 30, 50)
    person = someone(whole)
    area = WholeArea(person)
    # The template has adapted to the half that is seen.
    assert not area.update(half, whole, person, hidden=lambda: True)
    for _ in range(10):
        assert not area.update(half, half, person)
    assert area.update(block(20, 10, 40, 48), whole, person)
    assert area.update(half, half, person)
