# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np

from gait_segmentation.segmentation.components import fill_holes, keep_supported


def test_the_best_supported_part_stays_and_the_rest_goes() -> None:
    labels = np.zeros((10, 20), np.bool_)
    labels[1:9, 1:5] = True
    labels[1:9, 10:18] = True
    support = np.zeros((10, 20), np.float32)
    support[:, :6] = 1
    kept = keep_supported(labels, support)
    assert kept[:, :6].any()
    assert not kept[:, 8:].any()


def test_a_well_supported_second_part_stays() -> None:
    labels = np.zeros((20, 10), np.bool_)
    labels[1:12, 2:8] = True
    labels[14:19, 2:5] = True
    kept = keep_supported(labels, np.ones((20, 10), np.float32))
    assert np.array_equal(kept, labels)


def test_nothing_stays_nothing() -> None:
    labels = np.zeros((5, 5), np.bool_)
    assert not keep_supported(labels, np.ones((5, 5), np.float32)).any()
    assert not fill_holes(labels, 3).any()


def test_only_small_inner_holes_are_filled() -> None:
    labels = np.ones((20, 20), np.bool_)
    labels[3, 3] = False
    labels[8:14, 8:14] = False
    labels[0, 10] = False
    filled = fill_holes(labels, 4)
    assert filled[3, 3]
    assert not filled[10, 10]
    assert not filled[0, 10]
