# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import Box
from gait_segmentation.starting.first_scene import FirstScene, first_scene

BOX = Box(20, 10, 40, 100)


def scene(known: NDArray[np.float32] | None = None) -> FirstScene:
    lab = np.full((120, 80, 3), 100, np.uint8)
    lab[40:, :] = 140
    lab[:, 50:, 1] = 130
    return first_scene(lab, BOX, 0.7, known)


def test_edges_have_the_direction_across_them() -> None:
    across, down = scene().edges
    assert abs(down[40, 10:40]).min() > 0.8
    assert abs(across[40, 10:40]).max() < 0.05
    assert abs(across[60:100, 50]).min() > 0.8
    assert abs(down[60:100, 50]).max() < 0.05
    assert not across[80:100, 10:40].any()
    assert not down[80:100, 10:40].any()
