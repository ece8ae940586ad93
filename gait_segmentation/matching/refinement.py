# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The box of a person by the template that was matched."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import Box

__all__ = ['refined_box']

_REACH = 0.12
"""How far from the template the person may reach, in body heights: clothes, bags, hands."""

_LIKELY = 190
"""Likelihood from which on pixels are taken for the person's."""

_LEAST = 0.02
"""Length of a row or column of them that is more than noise, in body heights."""


def refined_box(
    image: NDArray[np.uint8],
    template: NDArray[np.uint8],
    place: tuple[slice, slice],
    body: float,
    to_source: NDArray[np.float64],
) -> Box | None:
    """
    Return the box about what is likely where a template stands.

    The template says whose pixels these are, and the likelihood how far they go: people are
    broader than a model, by clothes and what they carry.

    :param image: (h, w) uint8 likelihood.
    :param template: (H, W) uint8, and ``place``, the rows and columns of the image it takes.
    :param body: height of the body in pixels of the image.
    :param to_source: (2, 3) transform from the image to the source.
    :returns: the upright box in source pixels, None if nothing is likely there.
    """
    near = np.zeros(image.shape, np.uint8)
    cv2.threshold(template, 127, 1, cv2.THRESH_BINARY, near[place])
    side = 2 * round(_REACH * body) + 1
    near = cv2.dilate(near, np.ones((side, side), np.uint8))
    inside = (image > _LIKELY) & (near > 0)
    least = _LEAST * body
    inside &= (inside.sum(axis=1) >= least)[:, None]
    inside &= inside.sum(axis=0) >= least
    rows = np.flatnonzero(inside.any(axis=1))
    if not rows.size:
        return None
    # Whichever way the image is turned, nothing reaches farther than an end of a row.
    first, last = inside[rows].argmax(axis=1), inside[rows, ::-1].argmax(axis=1)
    columns = np.concatenate([first, image.shape[1] - 1 - last])
    points = np.column_stack([columns + 0.5, np.tile(rows, 2) + 0.5])
    points = points @ to_source[:, :2].T + to_source[:, 2]
    half = 0.5 * float(np.hypot(*to_source[:, 0]))
    low, high = points.min(axis=0) - half, points.max(axis=0) + half
    return Box(float(low[0]), float(low[1]), *(high - low).tolist())
