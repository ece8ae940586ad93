# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np

from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.person.person import Person, new_colours
from gait_segmentation.tracking.recovery.silhouette import Silhouette

SHAPE = (60, 80)


def someone(mask: np.ndarray, x: float, y: float) -> Person:
    return Person(1, x, y, 30, 8, 8, mask, *new_colours(TrackingConfig()))


def block(left: int, top: int) -> np.ndarray:
    mask = np.zeros(SHAPE, np.uint8)
    mask[top : top + 30, left : left + 16] = 255
    return mask


def test_a_silhouette_is_laid_where_the_person_is() -> None:
    person = someone(block(20, 10), 28, 25)
    cut = Silhouette.of(person.mask, person)
    assert cut.middle == (0, 0)
    np.testing.assert_array_equal(cut.placed(person, SHAPE), person.mask)
    person.shift(7, -4)
    np.testing.assert_array_equal(cut.placed(person, SHAPE), block(27, 6))


def test_what_is_outside_of_the_image_comes_back() -> None:
    person = someone(block(20, 10), 28, 25)
    cut = Silhouette.of(person.mask, person)
    person.shift(-28, 0)
    assert np.count_nonzero(cut.placed(person, SHAPE)) == 30 * 8
    person.shift(-20, 0)
    assert not cut.placed(person, SHAPE).any()
    person.shift(48, 0)
    np.testing.assert_array_equal(cut.placed(person, SHAPE), block(20, 10))
