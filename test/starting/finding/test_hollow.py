# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Bodies of which only the rim stands out."""

import numpy as np

from gait_segmentation.geometry import Box
from gait_segmentation.starting.finding.blobs import Blob
from gait_segmentation.starting.finding.hollow import fill_hollow


def filled(rim, moving=None):
    """Return the likelihood of a rim, (h, w) bool, after filling it."""
    rows, columns = np.flatnonzero(rim.any(axis=1)), np.flatnonzero(rim.any(axis=0))
    box = Box(columns[0], rows[0], np.ptp(columns) + 1, np.ptp(rows) + 1)
    likelihood = np.where(rim, 255, 0).astype(np.uint8)
    shown = rim if moving is None else moving
    owners = np.where(rim, 3, 0).astype(np.uint8)
    area = int(rim.sum())
    fill_hollow(likelihood, shown.astype(np.uint8), owners, [Blob(box, area, area, 3)])
    return likelihood


def ring(height, width):
    rim = np.zeros((60, 60), bool)
    rim[5 : 5 + height, 10 : 10 + width] = True
    rim[8 : 2 + height, 13 : 7 + width] = False
    return rim


def test_a_hollow_body_is_filled_and_nothing_else():
    likelihood = filled(ring(50, 20))
    assert likelihood[30, 20] > 127
    assert (likelihood[5:55, 10:30] > 127).all()
    assert np.count_nonzero(likelihood) == 50 * 20


def test_between_legs_nothing_is_filled():
    rim = ring(50, 20)
    rim[40:55] = False
    rim[40:55, 10:14] = rim[40:55, 26:30] = True
    assert filled(rim)[50, 20] == 0


def test_what_is_too_wide_for_a_body_stays_as_it_is():
    assert filled(ring(40, 40))[25, 30] == 0


def test_what_somebody_left_behind_is_not_joined():
    rim = ring(50, 20)
    moving = rim.copy()
    moving[:, :12] = False
    moving[5:55, 12:14] |= rim[5:55, 12:14]
    rim[5:55, 5:7] = True
    likelihood = filled(rim, moving)
    assert likelihood[30, 8] == 0
    assert likelihood[30, 20] > 127
