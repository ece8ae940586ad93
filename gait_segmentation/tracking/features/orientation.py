# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Shape-texture: the orientation of the brightness gradients about a pixel.

Gradients g of a small neighbourhood vote with their squared length for twice their angle, so that
both flanks of a stripe vote alike (the structure tensor's main direction); pixels with weak
gradients say nothing.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.tracking.features.base import NEUTRAL, View

__all__ = ['FEATURE']

_SIDE = 5
"""Side of the neighbourhood in pixels."""

_LEAST = 150.0
"""Mean squared gradient, per pixel of distance, below which nothing is said (12 grey levels)."""


class Orientation:
    """Orientation of the gradients, modulo a half turn."""

    name = 'orientation'
    has_neutral = True

    def channel(self, view: View) -> NDArray[np.uint8]:
        """Return 8..255 for angles of 0..pi, NEUTRAL without gradients."""
        size = (_SIDE, _SIDE)
        dx = cv2.Sobel(view.gray, cv2.CV_32F, 1, 0, ksize=3, scale=1 / 8)
        dy = cv2.Sobel(view.gray, cv2.CV_32F, 0, 1, ksize=3, scale=1 / 8)
        real, imaginary = cv2.blur(dx * dx - dy * dy, size), cv2.blur(2 * dx * dy, size)
        step = view.step
        length, angle = cv2.cartToPolar(
            np.ascontiguousarray(real[::step, ::step]),
            np.ascontiguousarray(imaginary[::step, ::step]),
        )
        value = 8 + angle * np.float32(247 / (2 * np.pi))
        return np.where(length < _LEAST, NEUTRAL, np.minimum(value, 255)).astype(np.uint8)


FEATURE = Orientation()
