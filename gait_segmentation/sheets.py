# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures cut out, and put side by side on a sheet."""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np

from gait_segmentation.drawing import BACKDROP, Image
from gait_segmentation.errors import InputError
from gait_segmentation.geometry import Box

__all__ = [
    'COLUMNS',
    'TILES',
    'TILE_HEIGHT',
    'TILE_SIZE',
    'contact_sheet',
    'crop',
    'region_about',
]

TILES, COLUMNS = 28, 7
"""Frames on a contact sheet of somebody, and in a row of it."""

TILE_SIZE = (200, 256)
"""Width and height of one of them in pixels."""

TILE_HEIGHT = 1.35
"""Height of the region shown, in heights of the person."""


def region_about(box: Box, height: float, size: tuple[int, int]) -> Box:
    """
    Return what to show of the surroundings of a box.

    :param height: of the region, in the pixels of the box.
    :param size: (width, height) of the picture it is for, whose proportions it has.
    """
    return Box.from_center(box.center_x, box.center_y, height * size[0] / size[1], height)


def crop(image: Image, region: Box, size: tuple[int, int]) -> Image:
    """
    Return a region of an image or mask at a given size.

    :param region: in pixels; beyond the image it is dark (0 in a grey image).
    :param size: (width, height) of the result.
    """
    left, top = math.floor(region.x), math.floor(region.y)
    width = max(round(region.width), 1)
    height = max(round(region.height), 1)
    ground = BACKDROP if image.ndim == 3 else 0
    part = np.empty((height, width, *image.shape[2:]), np.uint8)
    part[:] = ground
    inside = Box(left, top, width, height).clipped(image.shape[1], image.shape[0])
    if inside is not None:
        rows, columns = inside.slices(image.shape[1], image.shape[0])
        part[rows.start - top : rows.stop - top, columns.start - left : columns.stop - left] = (
            image[rows, columns]
        )
    return _resized(part, size)


def contact_sheet(images: Sequence[Image], columns: int, gap: int = 4) -> Image:
    """
    Put pictures side by side, row by row.

    :param images: (H, W, 3) uint8, any sizes; every cell has the size of the largest.
    :param columns: pictures per row.
    :param gap: pixels between pictures and round the sheet.
    :raises InputError: if there is no picture or no column.
    """
    if not images or columns < 1:
        raise InputError(
            f'a sheet needs pictures and at least 1 column, got {len(images)} and {columns}'
        )
    columns = min(columns, len(images))
    height = max(image.shape[0] for image in images)
    width = max(image.shape[1] for image in images)
    rows = -(-len(images) // columns)
    sheet = np.empty((rows * (height + gap) + gap, columns * (width + gap) + gap, 3), np.uint8)
    sheet[:] = BACKDROP
    for place, image in enumerate(images):
        top = gap + place // columns * (height + gap)
        left = gap + place % columns * (width + gap)
        sheet[top : top + image.shape[0], left : left + image.shape[1]] = image
    return sheet


def _resized(image: Image, size: tuple[int, int]) -> Image:
    grows = size[0] >= image.shape[1]
    enlarging = cv2.INTER_LINEAR if image.ndim == 2 else cv2.INTER_CUBIC
    how = enlarging if grows else cv2.INTER_AREA
    return np.asarray(cv2.resize(image, size, interpolation=how))
