# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Edges with their orientation, of silhouettes and of images.

Orientation is that of the gradient and undirected, in [0, pi): whether the person is lighter or
darker than what is behind them is not known.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

__all__ = ['EdgePoints', 'Gradient', 'image_gradient', 'silhouette_edges', 'smoothing']

_SOBEL_GAIN = 8.0
"""Response of a 3 x 3 Sobel filter to a ramp of one level a pixel."""

_SILHOUETTE_LOW, _SILHOUETTE_HIGH = 15.0, 40.0
"""Canny's thresholds on a silhouette's gradient, levels a pixel."""

_IMAGE_LOW, _IMAGE_HIGH = 0.66, 1.33
"""Canny's thresholds on an image over its median grey level."""

_NOISE = 1.0
"""Gradients of fewer levels a pixel are noise, also in the dark."""

_SMOOTH_SHARE = 0.012
_SMOOTH_LEAST, _SMOOTH_MOST = 0.5, 1.5


class EdgePoints(NamedTuple):
    """``rows`` and ``columns``, (n,) int64, and ``orientation``, (n,) float32 in [0, pi)."""

    rows: NDArray[np.int64]
    columns: NDArray[np.int64]
    orientation: NDArray[np.float32]


class Gradient(NamedTuple):
    """
    The gradient of an image and its edges.

    ``orientation`` is (h, w) float32 in [0, pi); ``visible`` (h, w) bool says where the gradient
    is strong enough to have one and ``edges`` (h, w) bool where Canny's edges are.
    """

    orientation: NDArray[np.float32]
    visible: NDArray[np.bool_]
    edges: NDArray[np.bool_]


def smoothing(height: float) -> float:
    """Return the Gaussian sigma in pixels for the silhouette of a body of a height in pixels."""
    return min(max(_SMOOTH_SHARE * height, _SMOOTH_LEAST), _SMOOTH_MOST)


def silhouette_edges(silhouette: NDArray[np.uint8], height: float) -> EdgePoints:
    """
    Return the edge points of a silhouette: Canny on the smoothed mask.

    The image's border is no edge of a silhouette that reaches it.

    :param silhouette: (h, w) uint8, 255 inside, soft edge allowed.
    :param height: height of the body in pixels.
    """
    dx, dy = _sobel(silhouette, smoothing(height))
    edges = _canny(dx, dy, _SILHOUETTE_LOW, _SILHOUETTE_HIGH)
    rows, columns = np.nonzero(edges)
    return EdgePoints(rows, columns, _orientation(dx[rows, columns], dy[rows, columns]))


def image_gradient(grey: NDArray[np.uint8]) -> Gradient:
    """
    Return the gradient of an image, smoothed with a Gaussian of one pixel, and Canny's edges.

    Canny's thresholds are 0.66 and 1.33 times the median grey level, on Sobel's scale; the lower
    one also is that of a visible gradient.

    :param grey: (h, w) uint8.
    """
    dx, dy = _sobel(grey, 1.0)
    median = _median(grey) / _SOBEL_GAIN
    low, high = max(_IMAGE_LOW * median, _NOISE), max(_IMAGE_HIGH * median, 2 * _NOISE)
    x, y = dx.astype(np.float32), dy.astype(np.float32)
    visible = x * x + y * y > np.float32((_SOBEL_GAIN * low) ** 2)
    return Gradient(_orientation(dx, dy), visible, _canny(dx, dy, low, high))


def _sobel(image: NDArray[np.uint8], sigma: float) -> tuple[NDArray[np.int16], NDArray[np.int16]]:
    smooth = cv2.GaussianBlur(image, (0, 0), sigma, borderType=cv2.BORDER_REPLICATE)
    dx = cv2.Sobel(smooth, cv2.CV_16S, 1, 0, borderType=cv2.BORDER_REPLICATE)
    dy = cv2.Sobel(smooth, cv2.CV_16S, 0, 1, borderType=cv2.BORDER_REPLICATE)
    return dx, dy


def _canny(
    dx: NDArray[np.int16], dy: NDArray[np.int16], low: float, high: float
) -> NDArray[np.bool_]:
    low, high = _SOBEL_GAIN * low, _SOBEL_GAIN * high
    return np.asarray(cv2.Canny(dx, dy, low, high, L2gradient=True) > 0)


def _orientation(dx: NDArray[np.int16], dy: NDArray[np.int16]) -> NDArray[np.float32]:
    shape = dx.shape
    if dx.size == 0:
        return np.zeros(shape, np.float32)
    # cv2.phase is many times faster than arctan2, and exact to 0.01 degrees.
    angle = cv2.phase(dx.astype(np.float32), dy.astype(np.float32)).reshape(shape)
    half = np.float32(np.pi)
    return np.asarray(np.where(angle >= half, angle - half, angle))


def _median(grey: NDArray[np.uint8]) -> int:
    counts = cv2.calcHist([np.ascontiguousarray(grey)], [0], None, [256], [0, 256])
    return int(np.searchsorted(np.cumsum(counts), grey.size / 2))
