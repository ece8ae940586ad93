# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures cut out, and put side by side on a sheet."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import cv2
import numpy as np

from gait_segmentation.drawing import BACKDROP, Colour, Image, draw_label, draw_outline
from gait_segmentation.errors import InputError
from gait_segmentation.geometry import Box

TILES, COLUMNS = 28, 7  # frames on a contact sheet of somebody, and in a row of it
TILE_SIZE = (200, 256)  # width and height of one of them in pixels
TILE_HEIGHT = 1.35  # height of the region shown, in those of the person (widths, if that is more)


def spread(numbers: Sequence[int]) -> set[int]:
    """Return the frames that a contact sheet shows, evenly spread, or all if there are few."""
    places = np.linspace(0, len(numbers) - 1, min(TILES, len(numbers)))
    return {numbers[round(place)] for place in places}


def tile(image: Image, box: Box, outlines: Iterable[tuple[Image, Colour]], words: str) -> Image:
    """Return a picture of somebody and the surroundings, with outlines and words."""
    width, height = TILE_SIZE
    tall = TILE_HEIGHT * max(box.height, box.width)
    region = Box.from_center(box.center_x, box.center_y, tall * width / height, tall)
    # Cropped and enlarged first, so that outlines are drawn at full sharpness.
    picture = crop(image, region, TILE_SIZE)
    for mask, colour in outlines:
        draw_outline(picture, crop(mask, region, TILE_SIZE), colour)
    draw_label(picture, words, (2, 2))
    return picture


def crop(image: Image, region: Box, size: tuple[int, int]) -> Image:
    """Return a region of an image or mask at a given (width, height), dark beyond the image."""
    left, top = math.floor(region.x), math.floor(region.y)
    width, height = max(round(region.width), 1), max(round(region.height), 1)
    part = np.empty((height, width, *image.shape[2:]), np.uint8)
    part[:] = BACKDROP if image.ndim == 3 else 0
    inside = Box(left, top, width, height).clipped(image.shape[1], image.shape[0])
    if inside is not None:
        rows, columns = inside.slices(image.shape[1], image.shape[0])
        part[rows.start - top : rows.stop - top, columns.start - left : columns.stop - left] = (
            image[rows, columns]
        )
    enlarging = cv2.INTER_LINEAR if image.ndim == 2 else cv2.INTER_CUBIC
    how = enlarging if size[0] >= width else cv2.INTER_AREA
    return np.asarray(cv2.resize(part, size, interpolation=how))


def contact_sheet(images: Sequence[Image], columns: int = COLUMNS, gap: int = 4) -> Image:
    """Put pictures side by side, row by row, in cells of the size of the largest."""
    if not images or columns < 1:
        raise InputError(
            f'a sheet needs pictures and at least 1 column, got {len(images)} and {columns}'
        )
    columns = min(columns, len(images))
    height, width = (max(image.shape[axis] for image in images) for axis in (0, 1))
    rows = -(-len(images) // columns)
    sheet = np.empty((rows * (height + gap) + gap, columns * (width + gap) + gap, 3), np.uint8)
    sheet[:] = BACKDROP
    for place, image in enumerate(images):
        top = gap + place // columns * (height + gap)
        left = gap + place % columns * (width + gap)
        sheet[top : top + image.shape[0], left : left + image.shape[1]] = image
    return sheet
