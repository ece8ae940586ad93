# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the segmentation stage takes: checks, and the windows it works in."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import InputError
from gait_segmentation.geometry import BodyFrame, Box, body_window
from gait_segmentation.images import Window, check_map
from gait_segmentation.sizes import same_proportions, shrink

__all__ = ['check_sizes', 'in_window', 'no_finer', 'source_window', 'window_about', 'without']

_MOST_PIXELS = 2**18
"""Pixels about a body in which it is cut out: three times what the tracker's working height asks
for.  A cut takes 0.6 kB for each."""


def check_sizes(
    image: NDArray[np.uint8], likelihood: NDArray[np.uint8], prior: NDArray[np.uint8]
) -> None:
    """
    Refuse a likelihood and a shape prior that do not fit the image or each other.

    :param image: (H, W, 3) uint8.
    :param likelihood: (h, w) uint8, of its proportions and no larger.
    :param prior: (h, w) uint8.
    :raises InputError: if shapes or types do not fit.
    """
    for name, array in (('likelihood', likelihood), ('shape prior', prior)):
        check_map(array, name)
    if likelihood.shape != prior.shape:
        raise InputError(
            f'likelihood and shape prior must have the same size, got {likelihood.shape} '
            f'and {prior.shape}'
        )
    smaller = all(
        size <= whole for size, whole in zip(likelihood.shape, image.shape[:2], strict=True)
    )
    if not smaller or not same_proportions(likelihood.shape, image.shape[:2]):
        raise InputError(
            f'likelihood must have the proportions of the image {image.shape[:2]} and be no '
            f'larger, got {likelihood.shape}'
        )


def no_finer(
    likelihood: NDArray[np.uint8], prior: NDArray[np.uint8], body: BodyFrame, width: int
) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """
    Return a likelihood and a shape prior, smaller if they show a body finer than it is cut out.

    :param likelihood, prior: (h, w) uint8.
    :param body: in pixels of the image.
    :param width: of the image.
    """
    rows, columns = window_about(body.scaled(likelihood.shape[1] / width), None, likelihood.shape)
    pixels = max(rows.stop - rows.start, 0) * max(columns.stop - columns.start, 0)
    if pixels <= _MOST_PIXELS:
        return likelihood, prior
    factor = (_MOST_PIXELS / pixels) ** 0.5
    height, across = (max(1, round(factor * size)) for size in likelihood.shape)
    return shrink(likelihood, (height, across)), shrink(prior, (height, across))


def window_about(body: BodyFrame, last: Box | None, shape: tuple[int, int]) -> Window:
    """
    Return the window in which a body is cut out, which may be empty.

    :param body: the body in working pixels.
    :param last: what was found of it in the frame before, which the window then holds as well.
    :param shape: (h, w) of the working image.
    """
    box = body_window(body.center_x, body.center_y, body.height)
    if last is not None and last.iou(box) > 0:
        box = body_window(body.center_x, body.center_y, body.height, last)
    return box.slices(shape[1], shape[0])


def without(
    likelihood: NDArray[np.uint8], window: Window, taken: NDArray[np.uint8]
) -> NDArray[np.uint8]:
    """Return a likelihood without the pixels that are taken, given in the source's window."""
    out = likelihood.copy()
    part = out[window]
    part[shrink(taken, (part.shape[0], part.shape[1])) > 127] = 0
    return out


def in_window(body: BodyFrame, window: Window) -> BodyFrame:
    """Return a body in the pixels of a window."""
    return BodyFrame(
        body.center_x - window[1].start,
        body.center_y - window[0].start,
        body.height,
        body.angle,
    )


def source_window(window: Window, scale: float, shape: tuple[int, int]) -> Window:
    """Return the rows and columns of the source that a working window covers."""
    rows, columns = (
        slice(min(round(part.start / scale), size), min(round(part.stop / scale), size))
        for part, size in zip(window, shape, strict=True)
    )
    return rows, columns
