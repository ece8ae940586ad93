# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a body is in a blob: without the shadow at its feet and the place it just left."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import Box

__all__ = ['seat']

_ASPECT = 0.4
_UPPER = 0.7
"""Share of the height that is clear of shadows on the ground."""

_TRIM = 0.02
"""Share of the pixels left out at the top and the bottom."""

_LEAST_SHARE = 0.1
"""Share of the box that must stand out for the likelihood to tell more than the blob."""


def seat(likelihood: NDArray[np.uint8], blob: Box) -> Box:
    """
    Return a box of usual proportions about the body in a blob.

    :param likelihood: (h, w) uint8, 255 = surely no background.
    :param blob: the box of a blob; returned but for its width if hardly anything stands out in it.
    """
    rows, columns = blob.slices(likelihood.shape[1], likelihood.shape[0])
    part = likelihood[rows, columns] > 127
    total = np.cumsum(part.sum(axis=1))
    if total.size == 0 or total[-1] < _LEAST_SHARE * part.size:
        return Box.from_center(blob.center_x, blob.center_y, _ASPECT * blob.height, blob.height)
    top = int(np.searchsorted(total, _TRIM * total[-1]))
    bottom = int(np.searchsorted(total, (1 - _TRIM) * total[-1])) + 1
    upper = np.cumsum(part[top : top + max(1, round(_UPPER * (bottom - top)))].sum(axis=0))
    middle = int(np.searchsorted(upper, 0.5 * upper[-1])) + 0.5
    height = bottom - top
    return Box.from_center(
        columns.start + middle, rows.start + (top + bottom) / 2, _ASPECT * height, height
    )
