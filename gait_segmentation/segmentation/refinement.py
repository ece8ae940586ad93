# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
What becomes of the first cut: the parts that are the person's, and the outline at full resolution.

The outline is cut again in a narrow band about the first (banded cuts), at a cost that follows its
length, not the area of the image.
"""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import Box
from gait_segmentation.images import distance_from, shrink
from gait_segmentation.segmentation.graph_cut import contrast_links, minimum_cut, open_graph

# Summed support of a part, as a share of the best one's, from which it may stay.
_LEAST_OVERLAP = 0.04
_APART = 0.12  # distance from the template, in body heights, beyond which nothing supports a part
# Most that the second cut is finer than the first: 320 px for a person at the standard size.
_FINEST = 2.5


def keep_supported(
    labels: NDArray[np.bool_],
    support: NDArray[np.float32],
    body: NDArray[np.bool_] | None = None,
    height: float = 0.0,
) -> NDArray[np.bool_]:
    """
    Keep the components with more than 4 % of the largest one's support.

    Of a part that lies mostly apart from the body nothing counts: that is a passer-by.

    :param labels: (h, w) bool, the cut.
    :param support: (h, w) float32 in 0..1, where the person is expected.
    :param body: (h, w) bool, where the template is; None if that is not known.
    :param height: height of the body in pixels.
    """
    count, parts = cv2.connectedComponents(labels.view(np.uint8), connectivity=4)
    if count <= 2:
        return labels
    overlap = np.bincount(parts.ravel(), support.ravel(), count)
    overlap[0] = 0
    if body is not None and body.any():
        away = distance_from(body)
        apart = np.bincount(parts.ravel(), (away > _APART * height).ravel(), count)
        overlap[2 * apart > np.bincount(parts.ravel(), minlength=count)] = 0
    return np.asarray((overlap > _LEAST_OVERLAP * overlap.max())[parts])


def finest(image: NDArray[np.uint8], shape: tuple[int, int]) -> NDArray[np.uint8]:
    """
    Return a window as fine as its outline is cut.

    Finer than that the outline is interpolated: the nodes of the cut would grow with the square
    of the resolution, for a fraction of a percent of the body's height.

    :param image: (H, W, 3) uint8, the window at full resolution.
    :param shape: (h, w) of the first cut of it.
    """
    if image.shape[0] <= _FINEST * shape[0]:
        return image
    return shrink(image, (math.ceil(_FINEST * shape[0]), math.ceil(_FINEST * shape[1])))


def upsample(labels: NDArray[np.bool_], shape: tuple[int, int]) -> NDArray[np.bool_]:
    """Return a mask at another size, its outline interpolated."""
    if labels.shape == shape:
        return labels
    values = labels.view(np.uint8) * np.uint8(255)
    grown = cv2.resize(values, shape[::-1], interpolation=cv2.INTER_LINEAR)
    return np.asarray(grown > 127)


def refine(
    image: NDArray[np.uint8],
    labels: NDArray[np.bool_],
    logit: NDArray[np.float32],
    contrast: float,
) -> NDArray[np.bool_]:
    """
    Cut again at the size of the image, a pixel of the first cut about its outline.

    :param image: (H, W, 3) uint8, the window at full resolution, or as :func:`finest` gives it.
    :param labels: (h, w) bool, the first cut of the same window at working size.
    :param logit: (h, w) float32, its data term.
    :param contrast: weight of the contrast term of the first cut.
    :returns: (H, W) bool.
    """
    shape = image.shape[:2]
    scale = labels.shape[0] / shape[0]
    if labels.shape == shape:
        return labels
    refined = upsample(labels, shape)
    reach = max(1, round(1 / scale))
    found = Box.around(refined)
    if found is None:
        return refined
    part = found.slices(shape[1], shape[0], reach + 1)
    area = refined[part].view(np.uint8)
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1, 2 * reach + 1))
    fixed = cv2.erode(area, kernel).view(np.int8) + cv2.dilate(area, kernel).view(np.int8)
    fixed -= np.int8(1)
    graph = open_graph(fixed)
    if len(graph.pixels) == 0:
        return refined
    cut = np.ascontiguousarray(image[part])
    # A working pixel's evidence is shared by 1/scale^2 pixels, a link's by 1/scale of them.
    fine = cv2.resize(logit, shape[::-1], interpolation=cv2.INTER_LINEAR)[part]
    data = np.float32(scale) * fine.reshape(-1)[graph.pixels]
    contrast_links(graph, cut, contrast)
    refined[part] = minimum_cut(graph, data)
    return refined
