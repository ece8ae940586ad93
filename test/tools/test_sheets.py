# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.drawing import BACKDROP
from gait_segmentation.errors import InputError
from gait_segmentation.geometry import Box
from gait_tools.sheets import TILE_SIZE, contact_sheet, crop, spread, tile


def test_crops_have_the_size_asked_for():
    image = np.arange(20 * 30 * 3, dtype=np.uint8).reshape(20, 30, 3)
    same = crop(image, Box(5, 4, 10, 8), (10, 8))
    np.testing.assert_array_equal(same, image[4:12, 5:15])
    beyond = crop(image, Box(-5, -4, 10, 8), (10, 8))
    assert tuple(beyond[0, 0]) == BACKDROP
    np.testing.assert_array_equal(beyond[4:, 5:], image[:4, :5])
    assert crop(image, Box(100, 100, 10, 8), (50, 40)).shape == (40, 50, 3)
    assert crop(image[..., 0], Box(-5, -4, 10, 8), (20, 16))[0, 0] == 0


def test_a_tile_shows_somebody_in_the_middle_with_outlines():
    image = np.full((60, 60, 3), 90, np.uint8)
    first = np.zeros((60, 60), np.uint8)
    first[10:50, 20:40] = 255
    second = np.roll(first, 8, axis=1)
    outlines = [(second, (255, 90, 255)), (first, (50, 255, 50))]
    picture = tile(image, Box(20, 10, 20, 40), outlines, '7')
    assert picture.shape == (TILE_SIZE[1], TILE_SIZE[0], 3)
    green = (picture[..., 1] > 220) & (picture[..., 2] < 100)
    pink = (picture[..., 1] < 120) & (picture[..., 2] > 220)
    assert green.sum() > 300
    assert pink.sum() > 100
    rows, columns = np.nonzero(green)
    # A crop begins at a whole pixel, which is enlarged almost five times.
    assert abs((columns.min() + columns.max()) / 2 - TILE_SIZE[0] / 2) < 5
    assert abs((rows.min() + rows.max()) / 2 - TILE_SIZE[1] / 2) < 5


def test_frames_are_spread_evenly():
    shown = sorted(spread(range(100, 200)))
    assert len(shown) == 28
    assert (shown[0], shown[-1]) == (100, 199)
    assert max(np.diff(shown)) <= 4
    assert spread([3, 5]) == {3, 5}


def test_a_sheet_has_a_cell_for_every_picture():
    pictures = [np.full((4, 6, 3), 10 * k, np.uint8) for k in range(1, 6)]
    sheet = contact_sheet(pictures, 3, gap=2)
    assert sheet.shape == (2 * 6 + 2, 3 * 8 + 2, 3)
    assert sheet[3, 3, 0] == 10
    assert sheet[3, 19, 0] == 30
    assert sheet[9, 11, 0] == 50
    assert tuple(sheet[9, 19]) == BACKDROP
    assert contact_sheet(pictures[:1], 7).shape == (12, 14, 3)
    for pictures, columns in (([], 3), ([np.zeros((2, 2, 3), np.uint8)], 0)):
        with pytest.raises(InputError, match=f'got {len(pictures)} and {columns}'):
            contact_sheet(pictures, columns)
