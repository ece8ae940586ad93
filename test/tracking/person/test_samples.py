# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np

from gait_segmentation.tracking.person.samples import samples


def blob(seed: int) -> np.ndarray:
    noise = np.random.default_rng(seed).integers(0, 256, (50, 41), np.uint8)
    smooth = cv2.GaussianBlur(noise, (0, 0), 3.0)
    return np.where(smooth > np.quantile(smooth, 0.7), np.uint8(255), np.uint8(0))


def test_all_of_the_mask_and_what_does_not_touch_it_is_learnt() -> None:
    mask = blob(0)
    inside, outside = samples(mask, None, 4.0)
    np.testing.assert_array_equal(inside, mask > 0)
    np.testing.assert_array_equal(outside, cv2.dilate(mask, np.ones((3, 3), np.uint8)) == 0)


def test_of_the_mask_only_what_is_near_the_template_is_the_persons() -> None:
    mask, template = blob(1), blob(2)
    inside, _ = samples(mask, template, 3.0)
    near = cv2.distanceTransform(255 - template, cv2.DIST_L2, 3) < 3
    np.testing.assert_array_equal(inside, (mask > 0) & near)
    assert 0 < inside.sum() < (mask > 0).sum()


def test_a_template_elsewhere_leaves_nothing_and_none_leaves_all() -> None:
    mask, template = np.zeros((60, 60), np.uint8), np.zeros((60, 60), np.uint8)
    mask[5:20, 5:20] = 255
    assert samples(mask, template, 3.0)[0].sum() == 15 * 15
    template[45:55, 45:55] = 255
    assert not samples(mask, template, 3.0)[0].any()
    assert not samples(np.zeros_like(mask), template, 3.0)[0].any()


def test_a_shadow_on_known_ground_is_the_persons_only_inside_the_template() -> None:
    mask, template = blob(1), blob(2)
    familiar = blob(5) > 0
    every, outside = samples(mask, template, 3.0)
    inside, still_outside = samples(mask, template, 3.0, familiar)
    np.testing.assert_array_equal(inside, every & ~(familiar & (template == 0)))
    np.testing.assert_array_equal(still_outside, outside)
    assert inside.sum() < every.sum()
    assert (inside & familiar).any()
