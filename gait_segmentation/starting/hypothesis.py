# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A hypothesis about a first box: templates of one direction of walking laid onto it."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import Window
from gait_segmentation.kernels import kernel

__all__ = ['Hypothesis']

_LEAST_SIGMA = 0.3


@dataclass(frozen=True)
class Hypothesis:
    """
    All templates of one direction and tilt (radians) laid onto a box.

    ``templates`` is (K, h, w) uint8 in the rows and columns ``part`` of the window, beyond which
    they are zero, ``weight`` (K,) float32 their prior weight by aspect, ``axis`` (K,) float32 the
    x of the body's axis in the window, ``top`` (K,) float32 its upper end and ``height`` (K,)
    float32 the body's height, all in pixels.
    """

    azimuth: float
    angle: float
    part: Window
    templates: NDArray[np.uint8]
    weight: NDArray[np.float32]
    axis: NDArray[np.float32]
    top: NDArray[np.float32]
    height: NDArray[np.float32]

    def similarities(self, likelihood: NDArray[np.float32]) -> NDArray[np.float32]:
        """
        Return the Tanimoto similarity (paper, Eq. 1) of a likelihood with each template.

        :param likelihood: (h, w) float32 in 0..1, the whole window.
        :returns: (K,) float32.
        """
        image = np.round(likelihood * 255).astype(np.int16)
        count = len(self.templates)
        common = np.zeros(count, np.int64)
        total = np.zeros(count, np.int64)
        part = image[self.part].ravel()
        _overlaps(self.templates.reshape(count, -1), part, common, total)
        whole = total + int(image.sum(dtype=np.int64)) - common
        return (common / np.maximum(whole, 1)).astype(np.float32)

    def average(
        self, weights: NDArray[np.float32], shape: tuple[int, int], sigma: float
    ) -> NDArray[np.float32]:
        """
        Return the weighted mean of the templates, blurred, (h, w) float32 in 0..1.

        :param weights: (K,) float32.
        :param shape: (h, w) of the window.
        :param sigma: of the blur, in pixels.
        """
        share = (weights / max(float(weights.sum()), 1e-12) / 255).astype(np.float32)
        part, mean = np.zeros(self.templates.shape[1:], np.float32), np.zeros(shape, np.float32)
        _add_weighted(self.templates, share, part)
        mean[self.part] = part
        return np.asarray(cv2.GaussianBlur(mean, (0, 0), max(sigma, _LEAST_SIGMA)))


@kernel('u1[:,::1], i2[::1], i8[::1], i8[::1]')
def _overlaps(
    templates: NDArray[np.uint8],
    image: NDArray[np.int16],
    common: NDArray[np.int64],
    total: NDArray[np.int64],
) -> None:
    for k in range(templates.shape[0]):
        c = 0
        t = 0
        for x in range(image.shape[0]):
            value = np.int16(templates[k, x])
            c += min(value, image[x])
            t += value
        common[k] = c
        total[k] = t


@kernel('u1[:,:,::1], f4[::1], f4[:,::1]')
def _add_weighted(
    templates: NDArray[np.uint8], share: NDArray[np.float32], mean: NDArray[np.float32]
) -> None:
    for k in range(templates.shape[0]):
        if share[k] > 1e-6:
            for row in range(mean.shape[0]):
                for col in range(mean.shape[1]):
                    mean[row, col] += share[k] * np.float32(templates[k, row, col])
