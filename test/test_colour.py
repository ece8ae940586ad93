# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest

from gait_segmentation.colour import (
    BANDS,
    BINS,
    ColourModel,
    body_rows,
    colour_bins,
    gray_lab,
    is_gray,
)


def model(band_share: float = 0.7) -> ColourModel:
    return ColourModel(band_share, 1e-4)


def test_unseen_colours_have_the_floor() -> None:
    colours = model()
    bins = np.zeros((BANDS, 4), np.uint16)
    rows = np.repeat(np.linspace(0.01, 0.99, BANDS, dtype=np.float32)[:, None], 4, 1)
    colours.accumulate(bins, rows, np.zeros(bins.shape, np.float32), 1)
    assert np.all(colours.table == np.float32(1e-4))
    colours.accumulate(bins, rows, np.ones(bins.shape, np.float32), 0.15)
    assert np.all(colours.table[1:] == np.float32(1e-4))
    assert colours.table[0] == pytest.approx(np.full(BANDS, 1 + 1e-4), abs=1e-5)


def test_each_band_knows_its_own_colour_best() -> None:
    colours = model()
    rows = np.repeat(((np.arange(BANDS) + 0.5) / BANDS).astype(np.float32)[:, None], 10, 1)
    bins = np.repeat(np.arange(BANDS, dtype=np.uint16)[:, None], 10, 1)
    colours.accumulate(bins, rows, np.ones(bins.shape, np.float32), 1.0)
    table = colours.table[:BANDS]
    assert np.array_equal(table.argmax(axis=1), np.arange(BANDS))
    # A neighbouring band counts half, one further away only through the whole body.
    assert table[3, 3] > table[3, 4] > table[3, 6] > 1e-4
    assert table[3, 2] == pytest.approx(table[3, 4])
    assert colours.table.sum(axis=0) == pytest.approx(np.full(BANDS, 1 + 1e-4 * BINS**3), rel=1e-3)


@pytest.mark.parametrize('angle', [0.0, 0.4, -1.2])
def test_rows_count_down_the_axis_of_the_body_wherever_the_window_begins(angle: float) -> None:
    found = body_rows((5, 7), (30, 12), (33.0, 16.0), 20.0, angle)
    y, x = np.mgrid[12:17, 30:37] + 0.5
    expected = 0.5 + (np.cos(angle) * (y - 16) - np.sin(angle) * (x - 33)) / 20
    np.testing.assert_allclose(found, expected, atol=1e-6)


@pytest.mark.parametrize('chroma', [110, 128])
def test_faded_colours_are_told_by_their_lightness(chroma: int) -> None:
    lab = np.random.default_rng(1).integers(0, 255, (16, 16, 3)).astype(np.uint8)
    rows = np.repeat(np.linspace(0.01, 0.99, 16, dtype=np.float32)[:, None], 16, 1)
    coloured, gray = model(), model()
    coloured.accumulate(colour_bins(lab), rows, np.ones(rows.shape, np.float32), 1.0)
    lab[..., 1:] = chroma
    gray.accumulate(colour_bins(lab), rows, np.ones(rows.shape, np.float32), 1.0)
    coloured.fade(chroma)
    np.testing.assert_allclose(coloured.table, gray.table, rtol=0, atol=1e-5)
    empty = model()
    empty.fade(chroma)
    assert np.all(empty.table == np.float32(1e-4))


def test_one_coloured_pixel_makes_a_colour_image() -> None:
    image = np.repeat(np.arange(24, dtype=np.uint8).reshape(4, 6, 1), 3, axis=2)
    assert is_gray(image)
    for channel in range(3):
        tinted = image.copy()
        tinted[3, 5, channel] += 1
        assert not is_gray(tinted)


def test_stripes_are_told_from_an_even_area_and_by_their_direction() -> None:
    gray = np.full((40, 90), 100, np.uint8)
    gray[:, :30] += (np.arange(30, dtype=np.uint8) // 2 % 2) * 60
    gray[:, 30:60] += (np.arange(40, dtype=np.uint8) // 2 % 2)[:, None] * 60
    upright, level, even = (
        gray_lab(gray)[10:30, x : x + 20, 1:].mean((0, 1)) for x in (5, 35, 65)
    )
    assert upright[0] > even[0] + 5
    assert level[1] > even[1] + 5
    assert upright[1] == pytest.approx(even[1], abs=0.5)
    assert level[0] == pytest.approx(even[0], abs=0.5)
    # Brightness is that of Lab.
    lab = cv2.cvtColor(cv2.merge([gray] * 3), cv2.COLOR_BGR2Lab)
    assert np.array_equal(gray_lab(gray)[..., 0], lab[..., 0])


def test_the_first_frame_is_taken_whole_and_later_ones_by_their_rate() -> None:
    colours, rows = model(), np.full((1, 4), 0.5, np.float32)
    for colour in (3, 9):
        colours.accumulate(
            np.full((1, 4), colour, np.uint16), rows, np.ones((1, 4), np.float32), 0.1
        )
    assert colours.table[[3, 9], BANDS // 2] == pytest.approx([0.9, 0.1], abs=2e-4)
