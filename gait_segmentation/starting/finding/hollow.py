# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Bodies that stand out at their rims only, made whole.

Of somebody in plain clothes who comes closer, or whose clothes are like what is behind, only the
outline stands out.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.kernels import kernel
from gait_segmentation.starting.finding.blobs import Blob

__all__ = ['fill_hollow']

_LEVEL = 150
"""Likelihood of what is enclosed."""

_WIDEST = 0.55
"""Width over height up to which a blob may be one body.  A tree in the wind is wider, and would
look the more like somebody if it were filled."""


def fill_hollow(
    likelihood: NDArray[np.uint8],
    moving: NDArray[np.uint8],
    owners: NDArray[np.uint8],
    blobs: Sequence[Blob],
) -> None:
    """
    Raise the likelihood of what lies within a slender blob.

    That is between pixels of the blob that move now and are likely, to the left and right and
    above and below: between the legs of a stride nothing is below.

    :param likelihood: (h, w) uint8, 255 = surely no background; changed.
    :param moving: (h, w) uint8, non-zero where something moves now.
    :param owners: (h, w) uint8, the number of the blob of each pixel.
    """
    for blob in blobs:
        if blob.box.width <= _WIDEST * blob.box.height:
            rows, columns = blob.box.slices(likelihood.shape[1], likelihood.shape[0])
            bounds = (rows.start, rows.stop, columns.start, columns.stop)
            _fill(likelihood, moving, owners, blob.number, bounds)


@kernel('u1[:,::1], u1[:,::1], u1[:,::1], i8, UniTuple(i8, 4)')
def _fill(
    likelihood: NDArray[np.uint8],
    moving: NDArray[np.uint8],
    owners: NDArray[np.uint8],
    number: int,
    bounds: tuple[int, int, int, int],
) -> None:
    """Fill one blob, within its first and last row and column."""
    top, bottom, left, right = bounds
    highest, lowest = np.full(right - left, bottom), np.full(right - left, -1)
    first, last = np.full(bottom - top, right), np.full(bottom - top, -1)
    for row in range(top, bottom):
        for col in range(left, right):
            if owners[row, col] == number and moving[row, col] and likelihood[row, col] > 127:
                highest[col - left] = min(highest[col - left], row)
                lowest[col - left] = row
                first[row - top] = min(first[row - top], col)
                last[row - top] = col
    for row in range(top, bottom):
        for col in range(first[row - top], last[row - top] + 1):
            if highest[col - left] <= row <= lowest[col - left]:
                likelihood[row, col] = max(likelihood[row, col], _LEVEL)
