# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np

from gait_segmentation.images import bounding_box
from gait_segmentation.tracking.recovery.parting import may_show_two, nearer, others_than, parts_of
from test.tracking.figures import Figure

ONE, TWO = Figure(100), Figure(170)


def cut_out(mask: np.ndarray) -> np.ndarray:
    x, y, width, height = bounding_box(mask)
    return np.ascontiguousarray(mask[y : y + height, x : x + width])


def test_one_person_is_one_part() -> None:
    mask = ONE.mask()
    assert not may_show_two(bounding_box(mask), ONE.height)
    assert len(parts_of(cut_out(mask), ONE.height)) == 1


def test_two_people_are_two_parts_though_something_narrow_connects_them() -> None:
    mask = ONE.mask() | TWO.mask()
    mask[95:98, 100:170] = 255
    assert may_show_two(bounding_box(mask), ONE.height)
    inside = cut_out(mask)
    left, right = sorted(parts_of(inside, ONE.height), key=lambda part: part.center)
    assert others_than(left, [left, right], ONE.height) == [right]
    theirs = nearer(inside, [right], [left])
    assert bool(theirs[right.pixels > 0].all())
    assert not theirs[left.pixels > 0].any()
    # What connects them goes to the nearer.
    strip = 97 - bounding_box(mask)[1]
    middle = inside.shape[1] // 2
    assert theirs[strip, middle + 4] == 255
    assert theirs[strip, middle - 4] == 0


def test_what_lies_above_each_other_is_of_one_person() -> None:
    mask = ONE.mask()
    cv2.rectangle(mask, (0, 88), (319, 94), 0, -1)
    upper, lower = parts_of(cut_out(mask), ONE.height)
    assert others_than(upper, [upper, lower], ONE.height) == []


def test_what_is_small_is_nobody() -> None:
    mask = ONE.mask()
    cv2.rectangle(mask, (150, 80), (170, 100), 255, -1)
    assert len(parts_of(cut_out(mask), ONE.height)) == 1
