# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The matched template in the working image."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import BodyFrame, Box, pixel_affine, reach, template_to_image

__all__ = ['warp_template']


def warp_template(
    template: NDArray[np.uint8], body: BodyFrame, fill: float, shape: tuple[int, int]
) -> NDArray[np.uint8]:
    """
    Warp a template to where a body stands.

    Interpolates linearly; where the template shrinks it is averaged over the pixels' areas.

    :param template: (H, W) uint8.
    :param body: where the body stands, in the image's pixels.
    :param fill: share of the template's rows the body takes.
    :param shape: (h, w) of the image.
    :returns: (h, w) uint8, 255 inside, soft edge.
    """
    result = np.zeros(shape, np.uint8)
    height, width = template.shape
    transform = template_to_image(body, height, width, fill)
    left, top, right, bottom = reach(transform, width, height)
    rows, columns = Box(left, top, right - left, bottom - top).slices(shape[1], shape[0])
    size = (columns.stop - columns.start, rows.stop - rows.start)
    if min(size) == 0:
        return result
    finer = max(1, math.ceil(fill * height / body.height - 0.25))
    transform[:, 2] -= columns.start, rows.start
    matrix = pixel_affine(finer * transform)
    warped = cv2.warpAffine(
        template, matrix, (size[0] * finer, size[1] * finer), flags=cv2.INTER_LINEAR
    )
    if finer > 1:
        warped = cv2.resize(warped, size, interpolation=cv2.INTER_AREA)
    result[rows, columns] = warped
    return result
