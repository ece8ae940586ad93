# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Images in CIE L*a*b*, and what takes the place of the two colours where an image has none.

In a grey image only the brightness would tell a person from the surroundings.  There the local
energy of the gradient, across and down (:func:`gray_lab`), stands where a colour image has a* and
b*: even cloth is told from a wall of the same brightness that has a texture.  All that works with
joint histograms of Lab takes it as it is.  (Shape-texture beside colour after Wang and Yagi, IEEE
Transactions on Image Processing 17(2), 2008.)
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.kernels import kernel

__all__ = ['NO_CHROMA', 'NO_GRADIENT', 'gray_lab', 'is_gray']

_SIGMA = 0.8
"""Of the Gaussian over which energy is gathered, in pixels."""

_GAIN = 0.3
"""Levels of a* or b* that a mean gradient of one level a pixel counts."""

NO_CHROMA = 128.0
"""Level of a* or b* that stands for no colour."""

NO_GRADIENT = 110.0
"""Level of a* or b* that stands for no gradient."""


@kernel('u1[:,:,::1]')
def _is_gray(bgr: NDArray[np.uint8]) -> bool:
    for row in range(bgr.shape[0]):
        for col in range(bgr.shape[1]):
            blue, green, red = bgr[row, col, 0], bgr[row, col, 1], bgr[row, col, 2]
            if blue != green or green != red:
                return False
    return True


def is_gray(bgr: NDArray[np.uint8]) -> bool:
    """Tell whether the channels of a (h, w, 3) uint8 image are equal in every pixel."""
    return bool(_is_gray(bgr))


def gray_lab(gray: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """
    Return brightness and gradient energy of a grey image in the place of L*, a* and b*.

    :param gray: (h, w) uint8.
    :returns: (h, w, 3) uint8: L* as OpenCV stores it, root mean square of the gradient across
        and of that down.
    """
    bgr = cv2.cvtColor(gray, cv2.COLOR_GRAY2BGR)
    lab = cv2.cvtColor(bgr, cv2.COLOR_BGR2Lab)
    for channel, (across, down) in enumerate(((1, 0), (0, 1)), 1):
        slope = cv2.Sobel(gray, cv2.CV_32F, across, down, ksize=3, scale=0.25)
        energy = cv2.sqrt(cv2.GaussianBlur(cv2.multiply(slope, slope), (0, 0), _SIGMA))
        lab[..., channel] = cv2.convertScaleAbs(energy, alpha=_GAIN, beta=NO_GRADIENT)
    return np.asarray(lab)
