# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Masks at half size, cut out."""

from __future__ import annotations

import numpy as np

from gait_segmentation.tracking.outline import Outline, doubled, halved


def block(top: int, left: int, height: int, width: int) -> Outline:
    mask = np.zeros((40, 60), np.uint8)
    mask[top : top + height, left : left + width] = 255
    return Outline.of(mask)


def test_an_outline_is_cut_out_tightly() -> None:
    outline = block(5, 7, 3, 4)
    assert outline.window == (slice(5, 8), slice(7, 11))
    assert outline.area == 12


def test_an_outline_begins_where_its_image_does() -> None:
    outline = Outline.of(np.full((3, 4), 255, np.uint8), 20, 30)
    assert outline.window == (slice(20, 23), slice(30, 34))


def test_nothing_is_in_an_empty_outline() -> None:
    outline = Outline.of(np.zeros((8, 8), np.uint8))
    assert outline.inside.size == 0
    assert outline.area == 0
    assert not outline.seen_in((slice(0, 8), slice(0, 8))).any()


def test_small_shifts_add_up() -> None:
    outline = block(5, 7, 3, 4)
    for _ in range(10):
        outline = outline.shifted(0.6, -0.4)
    assert outline.window == (slice(3, 6), slice(10, 14))


def test_only_what_lies_in_a_window_is_seen_there() -> None:
    outline = block(5, 7, 3, 4)
    part = outline.seen_in((slice(6, 20), slice(0, 9)))
    assert part.shape == (14, 9)
    assert np.count_nonzero(part) == 4
    assert part[0, 7] == 255
    assert not outline.seen_in((slice(20, 30), slice(0, 9))).any()


def test_the_window_about_an_outline_ends_with_the_image() -> None:
    outline = block(5, 7, 3, 4)
    assert outline.about(0, (40, 60)) == outline.window
    rows, columns = outline.about(10, (12, 60))
    assert (rows.start, rows.stop) == (0, 12)
    assert columns.start == 0
    assert columns.stop >= 21


def test_windows_at_half_size_lie_within() -> None:
    for window in ((slice(3, 17), slice(4, 11)), (slice(4, 18), slice(5, 12))):
        rows, columns = doubled(halved(window))
        assert window[0].start <= rows.start <= rows.stop <= window[0].stop
        assert window[1].start <= columns.start <= columns.stop <= window[1].stop
        assert rows.start % 2 == columns.start % 2 == 0


def test_an_outline_is_enlarged_into_any_window() -> None:
    outline = block(5, 7, 3, 4)
    whole = np.zeros((80, 120), np.uint8)
    whole[10:16, 14:22] = 255
    for window in ((slice(0, 80), slice(0, 120)), (slice(11, 40), slice(3, 20))):
        assert (outline.enlarged(window) == whole[window]).all()
