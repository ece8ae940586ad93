# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from gait_segmentation.drawing import BACKDROP
from gait_segmentation.errors import InputError
from gait_segmentation.geometry import Box
from gait_tools.sheets import contact_sheet, crop


def test_crops_have_the_size_asked_for():
    image = np.arange(20 * 30 * 3, dtype=np.uint8).reshape(20, 30, 3)
    same = crop(image, Box(5, 4, 10, 8), (10, 8))
    np.testing.assert_array_equal(same, image[4:12, 5:15])
    beyond = crop(image, Box(-5, -4, 10, 8), (10, 8))
    assert tuple(beyond[0, 0]) == BACKDROP
    np.testing.assert_array_equal(beyond[4:, 5:], image[:4, :5])
    assert crop(image, Box(100, 100, 10, 8), (50, 40)).shape == (40, 50, 3)
    assert crop(image[..., 0], Box(-5, -4, 10, 8), (20, 16))[0, 0] == 0


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
