# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np

from gait_segmentation.gait_model.extents import extents
from gait_segmentation.geometry import Box
from test.walkers import small_bank


def test_extents_are_the_boxes_of_the_thresholded_images():
    images = np.random.default_rng(1).integers(0, 256, (2, 3, 20, 15)).astype(np.uint8)
    images[0, 0] = 0
    images[:, :, :4] = images[:, :, :, 11:] = 9
    for threshold, found in zip((250, 30, 0), extents(images, (250, 30, 0)), strict=True):
        assert found.shape == (2, 3, 4)
        for place in np.ndindex(2, 3):
            box = Box.around(images[place] > threshold)
            expected = (0, 0, 0, 0) if box is None else (box.x, box.y, box.width, box.height)
            assert tuple(found[place]) == expected


def test_a_bank_knows_its_extents():
    bank = small_bank()
    tight, whole = bank.extents
    assert tight.shape == whole.shape == (bank.sequences, bank.phases, 4)
    assert (whole[..., 2:] >= tight[..., 2:]).all()
    assert (tight[..., 3] > 0.85 * bank.fill * bank.grid[0]).all()
    assert bank.extents[0] is tight
