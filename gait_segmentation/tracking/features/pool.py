# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The pool of features: what about a pixel may tell people from surroundings.

They are joint histograms of the colour spaces (Comaniciu, Ramesh and Meer 2003) and the
orientation of gradients.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

__all__ = ['NEUTRAL', 'POOL', 'Feature', 'View']

NEUTRAL = 0
"""Bin of the pixels that say nothing, in features that have such pixels."""

_ANGLE_BITS = 5
_FIRST = 256 >> _ANGLE_BITS
"""Angles begin here, in the second bin, so that none is neutral."""

_SIDE, _LEAST_GRADIENT = 5, 150.0
"""
Side in pixels of the neighbourhood whose gradients have an orientation, and their mean square, per
pixel of distance, below which nothing is said (12 grey levels).
"""


@dataclass(frozen=True)
class View:
    """
    The part of a frame in which pixels are judged.

    ``bgr`` is (h, w, 3) uint8, ``gray`` (h, w) uint8.  With a ``step`` n features are needed at
    every n-th pixel of every n-th row only.
    """

    bgr: NDArray[np.uint8]
    gray: NDArray[np.uint8]
    step: int = 1

    def thin(self, values: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return every ``step``-th pixel, contiguous."""
        return np.ascontiguousarray(values[:: self.step, :: self.step])

    @cached_property
    def colours(self) -> NDArray[np.uint8]:
        """Return blue, green and red of the pixels that are needed."""
        return self.thin(self.bgr)

    @cached_property
    def total(self) -> NDArray[np.float32]:
        """Return the sum of the three, at least 1."""
        blue, green, red = cv2.split(self.colours.astype(np.float32))
        return np.maximum(blue + green + red, np.float32(1))

    @cached_property
    def hsv(self) -> NDArray[np.uint8]:
        """Return hue, saturation and value of these pixels, all of 0..255."""
        return np.asarray(cv2.cvtColor(self.colours, cv2.COLOR_BGR2HSV_FULL))


@dataclass(frozen=True)
class Feature:
    """
    One or more numbers for each pixel, whose joint histogram is learnt.

    ``planes`` returns them for the pixels that are needed, uint8, of each of which the ``bits``
    highest bits count; with ``has_neutral`` pixels of the bin NEUTRAL say nothing.
    """

    name: str
    planes: Callable[[View], Sequence[NDArray[np.uint8]]]
    bits: tuple[int, ...]
    has_neutral: bool = False

    @property
    def bins(self) -> int:
        """Return the number of bins of the histogram."""
        return 1 << sum(self.bits)

    def places(self, view: View) -> NDArray[np.uint16]:
        """Return the bin of each pixel that is needed, (h, w) uint16."""
        out = np.zeros(view.colours.shape[:2], np.uint16)
        for plane, bits in zip(self.planes(view), self.bits, strict=True):
            out = (out << np.uint16(bits)) | (plane >> np.uint8(8 - bits))
        return out


def _shares(view: View) -> tuple[NDArray[np.uint8], ...]:
    """Return the shares of green and red in the sum of the three, which no brightness changes."""
    _, green, red = cv2.split(view.colours)
    return tuple(
        np.asarray(np.float32(255) * plane / view.total + 0.5).astype(np.uint8)
        for plane in (green, red)
    )


def _orientation(view: View) -> NDArray[np.uint8]:
    """Return the angle of the structure tensor: of gradients, whichever side is lighter."""
    dx = cv2.Sobel(view.gray, cv2.CV_32F, 1, 0, scale=1 / 8)
    dy = cv2.Sobel(view.gray, cv2.CV_32F, 0, 1, scale=1 / 8)
    squared = cv2.blur(cv2.merge([dx * dx - dy * dy, 2 * dx * dy]), (_SIDE, _SIDE))
    thin = squared[:: view.step, :: view.step]
    length, angle = cv2.cartToPolar(thin[..., 0].copy(), thin[..., 1].copy())
    values = _FIRST + np.asarray(angle) * np.float32((255 - _FIRST) / (2 * np.pi))
    return np.where(length < _LEAST_GRADIENT, NEUTRAL, np.minimum(values, 255)).astype(np.uint8)


POOL: tuple[Feature, ...] = (
    Feature('RGB', lambda view: cv2.split(view.colours), (3, 3, 3)),
    Feature('HSV', lambda view: cv2.split(view.hsv), (3, 3, 3)),
    Feature('rg', _shares, (5, 5)),
    Feature('HS', lambda view: cv2.split(view.hsv)[:2], (4, 4)),
    Feature('orientation', lambda view: (_orientation(view),), (_ANGLE_BITS,), has_neutral=True),
)
"""All features there are."""
