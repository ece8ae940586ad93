# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The pool of features: what about a pixel may tell people from surroundings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.tracking.features.histograms import SHIFT

__all__ = ['NEUTRAL', 'POOL', 'Feature', 'View']

NEUTRAL = 0
"""Value of a channel's pixels that say nothing, in features that have such pixels."""

_FIRST = 1 << SHIFT
"""Hues and angles begin here, in the second bin of the histograms, so that none is neutral."""

_LEAST_SATURATION = 20
"""Below it (of 255) the hue is noise."""

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
    A number for each pixel, whose histograms are learnt.

    ``channel`` returns the numbers of the pixels that are needed, uint8, contiguous; with
    ``has_neutral`` pixels of the value NEUTRAL say nothing.
    """

    name: str
    channel: Callable[[View], NDArray[np.uint8]]
    has_neutral: bool = False


def _plane(view: View, index: int) -> NDArray[np.uint8]:
    return np.asarray(cv2.extractChannel(view.colours, index))


def _share(view: View, index: int) -> NDArray[np.uint8]:
    """Return the share of a colour in the sum of the three, which no brightness changes."""
    return np.asarray(np.float32(255) * _plane(view, index) / view.total + 0.5).astype(np.uint8)


def _hue(view: View) -> NDArray[np.uint8]:
    """Return the hue, where there is enough colour to have one."""
    hue, saturation, _ = cv2.split(view.hsv)
    return np.where(saturation < _LEAST_SATURATION, NEUTRAL, np.maximum(hue, _FIRST)).astype(
        np.uint8
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
    *(Feature(name, partial(_plane, index=index)) for index, name in enumerate('BGR')),
    Feature('g', partial(_share, index=1)),
    Feature('r', partial(_share, index=2)),
    Feature('H', _hue, has_neutral=True),
    Feature('S', lambda view: np.asarray(cv2.extractChannel(view.hsv, 1))),
    Feature('orientation', _orientation, has_neutral=True),
)
"""All features there are."""
