# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Likelihoods on the pixel grid of templates, and templates and boxes on that of the source."""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import (
    BodyFrame,
    Box,
    compose,
    invert,
    pixel_affine,
    reach,
    template_to_image,
)

_ALL = 255
_REACH = 0.12
"""How far from the template the person may reach, in body heights: clothes, bags, hands."""
_LIKELY = 190
"""Likelihood from which on pixels are taken for the person's."""
_LEAST = 0.02
"""Length of a row or column of them that is more than noise, in body heights."""


def antialiasing_side(pitch: float) -> int:
    """
    Return the odd side of the box filter, in pixels, after which nothing aliases.

    :param pitch: distance of the samples in pixels of the image, above 0; up to 1 the side is 1.
    """
    return 2 * math.ceil(pitch / 2 - 0.75) + 1


def resampled(
    likelihood: NDArray[np.uint8],
    known: NDArray[np.uint8] | None,
    grids: Sequence[NDArray[np.float64]],
    size: tuple[int, int],
    side: int,
) -> tuple[NDArray[np.uint8], NDArray[np.uint8] | None]:
    """
    Resample a likelihood on grids of pixels, linearly, after a box filter.

    :param likelihood: (h, w) uint8.
    :param known: (h, w) uint8, 0 where the likelihood says nothing; None = known everywhere.
    :param grids: (2, 3) transforms from each grid to the likelihood, of which the last one reaches
        as far as any.
    :param size: columns and rows of the grids.
    :param side: of the box filter, in pixels of the likelihood.
    :returns: (S, rows, columns) uint8, one image for each grid, black where nothing is known, and
        the same with 255 where something is known; None if that is everywhere.
    """
    images = np.zeros((len(grids), size[1], size[0]), np.uint8)
    left, top, right, bottom = reach(grids[-1], *size)
    wanted = Box(left, top, right - left, bottom - top).padded(side + 1, side + 1)
    height, width = likelihood.shape
    window = wanted.slices(width, height)
    values = likelihood[window]
    if values.size == 0:
        return images, np.zeros_like(images)
    values, seen = _smoothed(values, None if known is None else known[window], side)
    if seen is None and (min(left, top) < 0 or right > width or bottom > height):
        seen = np.full(values.shape, _ALL, np.uint8)
    masks = None if seen is None else np.zeros_like(images)
    origin = np.array([[1.0, 0.0, -window[1].start], [0.0, 1.0, -window[0].start]])
    for index, grid in enumerate(grids):
        matrix, edge = pixel_affine(invert(compose(origin, grid))), cv2.BORDER_REPLICATE
        cv2.warpAffine(values, matrix, size, images[index], cv2.INTER_LINEAR, edge)
        if seen is not None and masks is not None:
            cv2.warpAffine(seen, matrix, size, masks[index], cv2.INTER_NEAREST)
    if masks is None or masks.all():
        return images, None
    return images & masks, masks


def _smoothed(
    values: NDArray[np.uint8], known: NDArray[np.uint8] | None, side: int
) -> tuple[NDArray[np.uint8], NDArray[np.uint8] | None]:
    """Return the means of squares over what is known, and where that is: 255, else 0."""
    seen = None if known is None else np.where(known != 0, _ALL, 0).astype(np.uint8)
    if seen is not None:
        values = cv2.bitwise_and(values, seen)
    if side > 1:
        values = cv2.blur(values, (side, side), borderType=cv2.BORDER_REPLICATE)
        if seen is not None:
            share = cv2.blur(seen, (side, side), borderType=cv2.BORDER_REPLICATE)
            values = cv2.divide(values, share, scale=_ALL)
    return values, seen


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
