# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a feature is, and what it looks at."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.kernels import kernel

__all__ = ['NEUTRAL', 'ChannelFeature', 'DirectFeature', 'Feature', 'View']

NEUTRAL = 0
"""Value of a channel's pixels that say nothing, in features that have such pixels."""


@dataclass(frozen=True)
class View:
    """
    The part of a frame in which pixels are judged.

    ``bgr`` is (h, w, 3) uint8, ``gray`` (h, w) uint8.  ``evidence`` maps names to (h, w) float32
    log-likelihood ratios that others have found for the pixels needed, e.g. the joint colour.
    ``heat`` is (h, w) uint8, P(person) from outside of this package, None without.
    With a ``step`` n features are needed at every n-th pixel of every n-th row only.
    """

    bgr: NDArray[np.uint8]
    gray: NDArray[np.uint8]
    evidence: dict[str, NDArray[np.float32]] = field(default_factory=dict)
    heat: NDArray[np.uint8] | None = None
    step: int = 1

    def thin(self, values: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return every ``step``-th pixel, contiguous."""
        return np.ascontiguousarray(values[:: self.step, :: self.step])

    @cached_property
    def thin_bgr(self) -> NDArray[np.uint8]:
        """Return the colours of the pixels that are needed."""
        bgr = np.ascontiguousarray(self.bgr)
        if self.step == 1:
            return bgr
        height, width = bgr.shape[:2]
        out = np.empty((-(-height // self.step), -(-width // self.step), 3), np.uint8)
        _thin_colours(bgr, self.step, out)
        return out

    def plane(self, index: int) -> NDArray[np.uint8]:
        """Return one of the three colours of the pixels that are needed."""
        return np.asarray(cv2.extractChannel(self.thin_bgr, index))

    def share(self, index: int) -> NDArray[np.uint8]:
        """Return the share of that colour in the sum of the three, times 255, rounded."""
        out = np.empty(self.thin_bgr.shape[:2], np.uint8)
        _share(self.thin_bgr, index, out)
        return out

    @cached_property
    def thin_hsv(self) -> NDArray[np.uint8]:
        """Return their hue, saturation and value, all of 0..255."""
        return np.asarray(cv2.cvtColor(self.thin_bgr, cv2.COLOR_BGR2HSV_FULL))


@kernel('u1[:,:,::1], i8, u1[:,:,::1]')
def _thin_colours(bgr: NDArray[np.uint8], step: int, out: NDArray[np.uint8]) -> None:
    for row in range(out.shape[0]):
        line, result = bgr[row * step], out[row]
        for col in range(out.shape[1]):
            for channel in range(3):
                result[col, channel] = line[col * step, channel]


@kernel('u1[:,:,::1], i8, u1[:,::1]')
def _share(bgr: NDArray[np.uint8], index: int, out: NDArray[np.uint8]) -> None:
    most, half = np.float32(255), np.float32(0.5)
    for row in range(out.shape[0]):
        pixels, result = bgr[row].reshape(-1), out[row]
        for col in range(result.size):
            total = (
                np.int32(pixels[3 * col])
                + np.int32(pixels[3 * col + 1])
                + np.int32(pixels[3 * col + 2])
            )
            share = np.float32(pixels[3 * col + index]) / np.float32(max(total, 1))
            result[col] = np.uint8(np.int32(most * share + half))


@dataclass(frozen=True)
class ChannelFeature:
    """
    A feature with one number per pixel, whose histograms are learnt.

    ``channel`` returns the numbers of the pixels that are needed, uint8, contiguous; with
    ``has_neutral`` pixels of the value NEUTRAL say nothing.
    """

    name: str
    channel: Callable[[View], NDArray[np.uint8]]
    has_neutral: bool = False


@dataclass(frozen=True)
class DirectFeature:
    """
    A feature that is a log-likelihood ratio itself.

    ``log_ratio`` returns the ratios of the pixels that are needed, float32, None if not known.
    """

    name: str
    log_ratio: Callable[[View], NDArray[np.float32] | None]


Feature = ChannelFeature | DirectFeature
"""
Something about a pixel that may tell people from surroundings.

A feature is a module of this package with a constant FEATURE.
"""
