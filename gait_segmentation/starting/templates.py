# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Templates stretched onto the first box, one hypothesis for each direction of walking."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.geometry import Box

__all__ = ['VIEWS', 'Hypothesis', 'fit_views']

VIEWS = (0.0, np.pi / 4, np.pi / 2, 3 * np.pi / 4, np.pi)
"""Directions of walking; towards and away from the camera look the same to a silhouette."""

_ANISOTROPY = 0.35
"""Most that a template is stretched in one direction against the other, as a logarithm."""

_ASPECT_SIGMA = 0.32
_NEGLIGIBLE = 0.02
"""Templates whose aspect is this much less likely than the best one's are left out."""

_TALLER = (1.0, 1.2, 1.5)
"""Bodies tried that reach beyond the border of the image, in heights of the box."""


@dataclass(frozen=True)
class Hypothesis:
    """
    All templates of one direction and tilt (radians) laid onto a box.

    ``templates`` is (K, h, w) uint8 in the window, ``weight`` (K,) float32 their prior weight
    by aspect, ``axis`` (K,) float32 the x of the body's axis in the window and ``height`` (K,)
    float32 the body's height, both in pixels.
    """

    azimuth: float
    angle: float
    templates: NDArray[np.uint8]
    weight: NDArray[np.float32]
    axis: NDArray[np.float32]
    top: NDArray[np.float32]
    height: NDArray[np.float32]


def fit_views(
    bank: TemplateBank,
    box: Box,
    shape: tuple[int, int],
    cut_top: bool,
    cut_bottom: bool,
    cut_side: bool,
    views: Sequence[float] = VIEWS,
    angle: float = 0.0,
) -> list[Hypothesis]:
    """
    Lay the templates of each direction onto a box, extents on extents.

    :param box: the tight box of the person in the window's pixels.
    :param shape: (h, w) of the window.
    :param views: the directions of walking.
    :param angle: tilt of the body in radians, positive when the head leans to the right.
    :param cut_top: whether the box touches the upper border of the image, so that the body may
        reach beyond; ``cut_bottom`` and ``cut_side`` likewise.
    """
    found = []
    for view in views:
        difference = np.angle(np.exp(1j * (bank.azimuth.astype(np.float64) - view)))
        nearest = np.abs(difference).min()
        sequences = np.flatnonzero(np.abs(difference) <= nearest + 1e-3)
        templates = bank.templates[sequences]
        templates = templates.reshape(-1, *templates.shape[2:])
        if angle:
            templates = _turned(templates, angle)
        found.append(_fit(bank, templates, view, box, shape, cut_top, cut_bottom, cut_side, angle))
    return found


def _fit(
    bank: TemplateBank,
    laid: NDArray[np.uint8],
    view: float,
    box: Box,
    shape: tuple[int, int],
    cut_top: bool,
    cut_bottom: bool,
    cut_side: bool,
    angle: float,
) -> Hypothesis:
    cut = cut_top or cut_bottom
    sigma = _ASPECT_SIGMA * (3 if cut or cut_side else 1)
    candidates = [
        (template, extent, factor, _weight(extent, factor, box, sigma))
        for template, extent in zip(*_extents(laid), strict=True)
        for factor in (_TALLER if cut else (1.0,))
    ]
    least = _NEGLIGIBLE * max(weight for *_, weight in candidates)
    grid_height, grid_width = laid.shape[1:]
    templates, weights, axes, tops, heights = [], [], [], [], []
    for template, extent, factor, weight in candidates:
        if weight < least:
            continue
        tall = box.height * factor
        top = box.y + box.height - tall if cut_top and not cut_bottom else box.y
        scale_y = tall / extent.height
        stretch = math.log(box.width / extent.width / scale_y)
        scale_x = scale_y * math.exp(min(max(stretch, -_ANISOTROPY), _ANISOTROPY))
        left = box.center_x - scale_x * extent.center_x
        # As geometry.pixel_affine does it, which is slow for hundreds of templates.
        shift_x = left + (scale_x - 1) / 2
        shift_y = top - scale_y * extent.y + (scale_y - 1) / 2
        matrix = np.array([[scale_x, 0, shift_x], [0, scale_y, shift_y]])
        templates.append(cv2.warpAffine(template, matrix, shape[::-1], flags=cv2.INTER_LINEAR))
        weights.append(weight)
        axes.append(left + scale_x * grid_width / 2)
        height = scale_y * bank.fill * bank.grid[0]
        middle = top + scale_y * (grid_height / 2 - extent.y)
        tops.append(middle - height / 2 if angle else top)
        heights.append(height)
    return Hypothesis(
        view,
        angle,
        np.stack(templates),
        np.array(weights, np.float32),
        np.array(axes, np.float32),
        np.array(tops, np.float32),
        np.array(heights, np.float32),
    )


def _weight(extent: Box, factor: float, box: Box, sigma: float) -> float:
    """Return how likely a body of the template's aspect fills the box."""
    ratio = math.log(extent.width / extent.height * factor * box.height / box.width)
    return math.exp(-0.5 * (ratio / sigma) ** 2)


def _turned(templates: NDArray[np.uint8], angle: float) -> NDArray[np.uint8]:
    """Return templates turned about the middle of their grid, on a square one that holds them."""
    height, width = templates.shape[1:]
    side = math.ceil(math.hypot(height, width))
    cos, sin = math.cos(angle), math.sin(angle)
    center = np.array([(width - 1) / 2, (height - 1) / 2])
    turn = np.array([[cos, -sin], [sin, cos]])
    matrix = np.column_stack([turn, (side - 1) / 2 - turn @ center])
    return np.stack([cv2.warpAffine(each, matrix, (side, side)) for each in templates])


def _extents(templates: NDArray[np.uint8]) -> tuple[list[NDArray[np.uint8]], list[Box]]:
    """Return the templates that are not empty, and their tight boxes."""
    inside = templates > 127
    rows: NDArray[np.bool_] = np.any(inside, axis=2)
    columns: NDArray[np.bool_] = np.any(inside, axis=1)
    top, left = rows.argmax(axis=1), columns.argmax(axis=1)
    bottom = rows.shape[1] - rows[:, ::-1].argmax(axis=1)
    right = columns.shape[1] - columns[:, ::-1].argmax(axis=1)
    used = np.flatnonzero(rows.any(axis=1))
    boxes = [
        Box(float(left[k]), float(top[k]), float(right[k] - left[k]), float(bottom[k] - top[k]))
        for k in used
    ]
    return [templates[k] for k in used], boxes
