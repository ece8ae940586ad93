# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from gait_segmentation.geometry import Box
from gait_segmentation.starting.first_scene import FirstScene, first_scene

BOX = Box(20, 10, 40, 100)


def scene(known: NDArray[np.float32] | None = None) -> FirstScene:
    lab = np.full((120, 80, 3), 100, np.uint8)
    lab[40:, :] = 140
    lab[:, 50:, 1] = 130
    return first_scene(lab, BOX, 0.7, known)


@pytest.mark.parametrize(
    ('mask', 'missing'),
    [
        ((20, 10, 60, 110), None),
        ((23, 10, 60, 110), None),
        ((30, 10, 60, 110), (20, 10, 34, 110)),
        ((20, 10, 48, 110), (44, 10, 60, 110)),
        ((20, 22, 60, 110), (20, 10, 60, 26)),
        ((20, 10, 60, 90), (20, 86, 60, 110)),
    ],
)
def test_sides_that_a_mask_misses_are_named(
    mask: tuple[int, int, int, int], missing: tuple[int, int, int, int] | None
) -> None:
    def block(left: int, top: int, right: int, bottom: int) -> NDArray[np.bool_]:
        image = np.zeros((120, 80), np.bool_)
        image[top:bottom, left:right] = True
        return image

    found = scene().unreached(block(*mask))
    if missing is None:
        assert found is None
    else:
        assert found is not None
        np.testing.assert_array_equal(found, block(*missing))


def test_a_box_that_need_not_be_exact_has_no_sides_to_miss() -> None:
    mask = np.zeros((120, 80), np.bool_)
    mask[50:60, 35:45] = True
    assert scene().unreached(mask) is not None
    assert scene(np.zeros((120, 80), np.float32)).unreached(mask) is None
    assert scene().unreached(np.zeros_like(mask)) is None


def test_edges_have_the_direction_across_them() -> None:
    across, down = scene().edges
    assert abs(down[40, 10:40]).min() > 0.8
    assert abs(across[40, 10:40]).max() < 0.05
    assert abs(across[60:100, 50]).min() > 0.8
    assert abs(down[60:100, 50]).max() < 0.05
    assert not across[80:100, 10:40].any()
    assert not down[80:100, 10:40].any()
