# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
What the contrast term must not cut off: arms and feet that the data term shows clearly.

Cuts are biased to short outlines, and what is thin has much outline for its area.  Before a busy
floor the edges of an arm count for little besides, because contrast is relative to its mean over
the window.  About thin parts the edges of the data term itself loosen the links.
"""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.kernels import kernel
from gait_segmentation.segmentation.graph_cut import STEPS, OpenGraph

__all__ = ['loosen_thin_parts']

_RADIUS = 0.03
"""What a disk of this radius, in body heights, does not fit into is thin."""

_BLUR_PX = 0.8
_LIMIT = 2.0
"""Log-odds beyond this are alike."""

_SPREAD = 0.8
"""Difference of blurred log-odds between neighbours that is an edge."""

_SPECK_PX, _ABOUT_PX = 2, 5
"""Sides of the squares that thin parts hold at least, and that they are widened by."""


def loosen_thin_parts(graph: OpenGraph, logit: NDArray[np.float32], height: float) -> None:
    """
    Weaken the links of a graph across the edges of thin likely parts.

    :param logit: (h, w) float32, the data term.
    :param height: height of the body in pixels.
    """
    smooth = cv2.GaussianBlur(logit, (0, 0), _BLUR_PX)
    likely = cv2.threshold(smooth, 0, 1, cv2.THRESH_BINARY)[1].astype(np.uint8)
    thick = cv2.morphologyEx(likely, cv2.MORPH_OPEN, _disk(max(1, round(_RADIUS * height))))
    thick = cv2.dilate(thick, np.ones((3, 3), np.uint8))
    thin = cv2.subtract(likely, thick)
    thin = cv2.morphologyEx(thin, cv2.MORPH_OPEN, np.ones((_SPECK_PX, _SPECK_PX), np.uint8))
    about = cv2.dilate(thin, np.ones((_ABOUT_PX, _ABOUT_PX), np.uint8))
    _loosen(smooth, about, graph.pixels, graph.beside, STEPS, graph.links)


def _disk(radius: int) -> NDArray[np.uint8]:
    size = (2 * radius + 1, 2 * radius + 1)
    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, size), np.uint8)


@kernel('f4[:,::1], u1[:,::1], i4[::1], i4[:,::1], i8[:,::1], i4[:,::1]')
def _loosen(
    smooth: NDArray[np.float32],
    about: NDArray[np.uint8],
    pixels: NDArray[np.int32],
    beside: NDArray[np.int32],
    steps: NDArray[np.int64],
    links: NDArray[np.int32],
) -> None:
    """Weaken links in both directions alike."""
    width = about.shape[1]
    near, odds = about.reshape(-1), smooth.reshape(-1)
    count = len(pixels)
    for node in range(count):
        pixel = pixels[node]
        if near[pixel] == 0:
            continue
        here = min(max(odds[pixel], -_LIMIT), _LIMIT)
        for arc in range(8):
            if beside[node, arc] == count:
                continue
            other = pixel + steps[arc, 0] * width + steps[arc, 1]
            if near[other] == 0:
                continue
            there = min(max(odds[other], -_LIMIT), _LIMIT)
            edge = (here - there) / _SPREAD
            links[node, arc] = int(links[node, arc] * math.exp(-edge * edge / 2))
