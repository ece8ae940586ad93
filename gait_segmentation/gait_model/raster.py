# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Drawing: projected ellipsoids to labelled pixels.

The outline of a projected ellipsoid follows from its support function; the outline of a hull of
several is, in every direction, the support of the member that reaches farthest.  Pixels are set
where their centre lies inside the outline, so shapes are neither grown nor shrunk, and the result
does not depend on a drawing library.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.kernels import kernel

__all__ = ['draw', 'hull_outline']

_DIRECTIONS = 96  # corners of an outline


@kernel()
def hull_outline(centers, axes, members, cosine, sine, outline):  # type: ignore[no-untyped-def]
    """
    Write the outline of the hull of some projected ellipsoids.

    :param centers: (E, 2) float64, x and y in pixels.
    :param axes: (E, 2, 3) float64, projected semi-axes as columns.
    :param members: (M,) int64, the ellipsoids of the hull.
    :param cosine: (K,) float64 cosines of K directions in ascending order.
    :param sine: (K,) float64 sines of the same.
    :param outline: (K, 2) float64, written: the convex outline.
    """
    for k in range(len(cosine)):
        best = -1e300
        for member in members:
            reach_x, reach_y, square = 0.0, 0.0, 0.0
            for a in range(3):
                along = axes[member, 0, a] * cosine[k] + axes[member, 1, a] * sine[k]
                reach_x += axes[member, 0, a] * along
                reach_y += axes[member, 1, a] * along
                square += along * along
            reach = math.sqrt(square)
            support = centers[member, 0] * cosine[k] + centers[member, 1] * sine[k] + reach
            if support > best:
                best = support
                scale = 1.0 / max(reach, 1e-12)
                outline[k, 0] = centers[member, 0] + reach_x * scale
                outline[k, 1] = centers[member, 1] + reach_y * scale


@kernel()
def _fill(outline, label, canvas, left, right):  # type: ignore[no-untyped-def]
    """Set the pixels of a convex outline to a label; ``left`` and ``right`` are scratch rows."""
    height, width = canvas.shape
    low, high = outline[:, 1].min(), outline[:, 1].max()
    first = max(math.ceil(low - 0.5), 0)
    last = min(math.ceil(high - 0.5), height)
    for row in range(first, last):
        left[row], right[row] = 1e300, -1e300
    for k in range(len(outline)):
        x0, y0 = outline[k - 1, 0], outline[k - 1, 1]
        x1, y1 = outline[k, 0], outline[k, 1]
        if y0 > y1:
            x0, y0, x1, y1 = x1, y1, x0, y0
        if y1 - y0 < 1e-12:
            continue
        slope = (x1 - x0) / (y1 - y0)
        begin = max(math.ceil(y0 - 0.5), first)
        end = min(math.ceil(y1 - 0.5), last)
        for row in range(begin, end):
            x = x0 + (row + 0.5 - y0) * slope
            left[row], right[row] = min(left[row], x), max(right[row], x)
    for row in range(first, last):
        begin = max(math.ceil(max(left[row], -1.0) - 0.5), 0)
        end = min(math.ceil(min(right[row], width + 1.0) - 0.5), width)
        for column in range(begin, end):
            canvas[row, column] = label


@kernel()
def _draw(centers, axes, members, starts, labels, directions, canvas):  # type: ignore[no-untyped-def]
    angles = 2.0 * math.pi / directions * np.arange(directions)
    cosine, sine = np.cos(angles), np.sin(angles)
    outline = np.empty((directions, 2))
    left, right = np.empty(canvas.shape[0]), np.empty(canvas.shape[0])
    for piece in range(len(labels)):
        span = members[starts[piece] : starts[piece + 1]]
        hull_outline(centers, axes, span, cosine, sine, outline)
        _fill(outline, labels[piece], canvas, left, right)


def draw(
    canvas: NDArray[np.uint8],
    centers: NDArray[np.float64],
    axes: NDArray[np.float64],
    pieces: tuple[tuple[int, ...], ...],
    labels: NDArray[np.uint8],
) -> None:
    """
    Paint pieces onto a canvas in the order given, later ones over earlier ones.

    :param canvas: (h, w) uint8, written in place; pixel (row, column) has its centre at
        (column + 0.5, row + 0.5).
    :param centers: (E, 2) projected centres, x and y in pixels.
    :param axes: (E, 2, 3) projected semi-axes as columns, in pixels.
    :param pieces: the ellipsoids of every piece.
    :param labels: (pieces,) uint8, the value to paint.
    """
    members = np.array([member for piece in pieces for member in piece], dtype=np.int64)
    starts = np.cumsum([0, *(len(piece) for piece in pieces)]).astype(np.int64)
    _draw(
        np.ascontiguousarray(centers, dtype=np.float64),
        np.ascontiguousarray(axes, dtype=np.float64),
        members,
        starts,
        labels,
        _DIRECTIONS,
        canvas,
    )
