# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.geometry import Box
from gait_segmentation.starting.finding.seat import seat

BODY = Box(60, 20, 24, 80)


def likelihood() -> np.ndarray:
    """Return (120, 160) uint8 with a body and its long shadow on the ground."""
    out = np.zeros((120, 160), np.uint8)
    out[20:100, 60:84] = 255
    out[90:100, 84:150] = 255
    return out


def test_a_shadow_does_not_draw_the_body_to_its_side() -> None:
    found = seat(likelihood(), Box(58, 18, 94, 84))
    assert found.center_x == pytest.approx(BODY.center_x, abs=2)
    assert found.center_y == pytest.approx(BODY.center_y, abs=3)
    assert found.height == pytest.approx(BODY.height, rel=0.05)


def test_a_place_just_left_does_not_count() -> None:
    # The blob reaches to where the body was; the likelihood does not.
    found = seat(likelihood()[:, :84], Box(10, 20, 74, 80))
    assert found.center_x == pytest.approx(BODY.center_x, abs=2)


def test_where_nothing_stands_out_the_blob_counts() -> None:
    blob = Box(30, 20, 50, 90)
    for dark in (np.zeros((120, 160), np.uint8), likelihood()[:0]):
        found = seat(dark, blob)
        assert (found.center_x, found.center_y, found.height) == (55, 65, 90)
