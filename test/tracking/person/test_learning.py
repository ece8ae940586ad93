# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest

from gait_segmentation.images import placed, shrink
from gait_segmentation.results import Feedback
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.person.learning import (
    WholeArea,
    grown,
    without_parts_apart,
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
    assert area.update(whole, person)
    assert not area.update(half, person)
    assert area.update(block(20, 10, 40, 48), person)


def test_a_first_mask_far_too_large_does_not_keep_others_out_for_ever() -> None:
    true = block(20, 10, 40, 50)
    person = someone(block(14, 10, 46, 50))
    area = WholeArea(person)
    assert not area.update(true, person)
    for _ in range(30):
        area.update(true, person)
    assert area.update(true, person)
    assert not area.update(block(20, 10, 40, 30), person)


def test_parts_apart_from_the_template_tell_nothing_of_the_body() -> None:
    mask, template = np.zeros((100, 160), np.uint8), np.zeros((100, 160), np.uint8)
    mask[10:90, 40:60] = template[12:88, 42:58] = 255
    assert without_parts_apart(mask, template, 80) is mask
    body = mask.copy()
    mask[30:60, 62:67] = 255
    assert without_parts_apart(mask, template, 80) is mask
    mask[30:60, 62:67] = 0
    mask[30:60, 120:140] = 255
    np.testing.assert_array_equal(without_parts_apart(mask, template, 80), body)
    assert without_parts_apart(mask, None, 80) is mask
    assert without_parts_apart(mask, np.zeros_like(mask), 80) is mask
    elsewhere = np.zeros_like(mask)
    elsewhere[95:, :5] = 255
    assert without_parts_apart(mask, elsewhere, 80) is mask
