# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A known place in other light: it is told by its texture, and by nothing else."""

import cv2
import numpy as np
import pytest

from gait_segmentation.scene.relight import relight

SHAPE = (60, 90)
SIGMA = 3.0
MIDDLE = np.s_[20:40, 30:60]
"""What the light of a test falls on, or what stands there."""

INNER = np.s_[24:36, 34:56]


def texture(seed: int, spread: float) -> np.ndarray:
    """Return a surface, (h, w, 3) float in BGR."""
    noise = np.random.default_rng(seed).normal(size=(*SHAPE, 3))
    soft = cv2.GaussianBlur(noise, (0, 0), 1.5)
    return 120 + spread * soft / soft.std()


def lab_of(image: np.ndarray) -> np.ndarray:
    """Return what a camera with some noise makes of an image."""
    noisy = image + np.random.default_rng(9).normal(0, 1, image.shape)
    return cv2.cvtColor(np.clip(noisy, 0, 255).astype(np.uint8), cv2.COLOR_BGR2Lab)


def known(image: np.ndarray, count: float = 5.0) -> np.ndarray:
    """Return the sums of a background that has seen a place so many times."""
    mean = cv2.cvtColor(image.astype(np.uint8), cv2.COLOR_BGR2Lab).astype(np.float32)
    counts = np.full((*SHAPE, 1), count, np.float32)
    return np.concatenate([count * mean, counts], axis=2)


@pytest.mark.parametrize('light', [0.3, 0.55, 0.8, 1.5])
def test_a_place_in_other_light_is_known_by_its_texture(light: float) -> None:
    place = texture(1, 18.0)
    seen = place.copy()
    seen[MIDDLE] *= light
    lab, sums = lab_of(seen), known(place)
    lit = relight(sums, lab, SIGMA)
    assert np.array_equal(lit[..., 3], sums[..., 3])

    def off(sums: np.ndarray) -> float:
        return float(np.percentile(np.abs(sums[..., :3] / 5 - lab)[INNER], 95))

    assert off(lit) < 2.5 * SIGMA < off(sums)


@pytest.mark.parametrize('what', ['coat', 'stripes', 'nothing to see', 'unknown'])
def test_what_is_something_else_or_may_be_is_left_as_it_was(what: str) -> None:
    place = texture(1, 0.0 if what == 'nothing to see' else 18.0)
    seen, sums = place.copy(), known(place, 0.0 if what == 'unknown' else 5.0)
    if what == 'coat':
        seen[MIDDLE] = (50, 70, 60)
    elif what == 'stripes':
        seen[MIDDLE] = 0.55 * texture(2, 18.0)[MIDDLE]
    else:
        seen[MIDDLE] *= 0.55
    lit = relight(sums, lab_of(seen), SIGMA)
    assert np.array_equal(lit[INNER], sums[INNER])


def in_half_the_light(spread: float = 18.0) -> tuple[np.ndarray, np.ndarray]:
    """Return the sums of a place, and a frame of it without noise."""
    place = texture(1, spread)
    return known(place), np.asarray(cv2.cvtColor(np.uint8(place / 2), cv2.COLOR_BGR2Lab))


def test_a_speck_in_the_shadow_is_not_the_place() -> None:
    sums, lab = in_half_the_light()
    lab[30, 40, 0] += 30
    lit = relight(sums, lab, SIGMA)
    assert np.array_equal(lit[30, 40], sums[30, 40])
    assert (lit[28:33, 42:45, 0] < 0.8 * sums[28:33, 42:45, 0]).all()


def test_a_place_of_which_some_pixels_are_unknown_is_known_by_the_others() -> None:
    sums, lab = in_half_the_light()
    sums[:, ::5] = 0
    lit = relight(sums, lab, SIGMA)
    assert not lit[:, ::5].any()
    assert (lit[10:50, 41:80:5, 0] < 0.8 * sums[10:50, 41:80:5, 0]).mean() > 0.9


def test_a_texture_weaker_than_the_noise_says_nothing() -> None:
    sums, lab = in_half_the_light(1.5)
    assert np.array_equal(relight(sums, lab, SIGMA), sums)
