# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The outline at full resolution: a second cut in a narrow band about the first (banded cuts).

Its cost follows the length of the outline, not the area of the image.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import Box
from gait_segmentation.segmentation.energy import contrast_links
from gait_segmentation.segmentation.graph_cut import minimum_cut

__all__ = ['refine', 'upsample']

_BAND = 1.0
"""Half width of the band, in pixels of the first cut."""


def upsample(labels: NDArray[np.bool_], shape: tuple[int, int]) -> NDArray[np.bool_]:
    """Return a mask at another size, its outline interpolated."""
    if labels.shape == shape:
        return labels
    grown = cv2.resize(labels.astype(np.float32), shape[::-1], interpolation=cv2.INTER_LINEAR)
    return np.asarray(grown > 0.5)


def refine(
    image: NDArray[np.uint8],
    labels: NDArray[np.bool_],
    logit: NDArray[np.float32],
    contrast: float,
) -> NDArray[np.bool_]:
    """
    Cut again at the size of the image.

    :param image: (H, W, 3) uint8, the window at full resolution.
    :param labels: (h, w) bool, the first cut of the same window at working size.
    :param logit: (h, w) float32, its data term.
    :param contrast: weight of the contrast term of the first cut.
    :returns: (H, W) bool.
    """
    shape = image.shape[:2]
    scale = labels.shape[0] / shape[0]
    refined = upsample(labels, shape)
    reach = max(1, round(_BAND / scale))
    found = Box.around(refined)
    if found is None:
        return refined
    part = found.padded(reach + 1, reach + 1).slices(shape[1], shape[0])
    area = refined[part].view(np.uint8)
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1, 2 * reach + 1))
    given = cv2.erode(area, kernel).astype(np.int8) + cv2.dilate(area, kernel).astype(np.int8) - 1
    # A working pixel's evidence is shared by 1/scale^2 pixels, a link's by 1/scale of them.
    fine = cv2.resize(logit * np.float32(scale), shape[::-1], interpolation=cv2.INTER_LINEAR)
    links = contrast_links(image[part], contrast, given)
    refined = refined.copy()
    refined[part] = minimum_cut(fine[part], links, given)
    return refined
