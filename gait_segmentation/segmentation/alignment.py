# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The template laid onto the likelihood more closely than the matcher places it.

The matcher shifts and scales all templates alike on a coarse grid.  Of the chosen one also width,
height and slant are fitted here: real people are broader than the model, lean a little, and who is
cut off by the image's border has no height that a box could tell.  What the fit maximises is the
sum of the likelihood, from -1 to 1, inside the template.  Rows of a template are few runs, so that
with running sums of the likelihood along rows a placement costs a few additions a row.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import BodyFrame
from gait_segmentation.kernels import kernel

__all__ = ['align']

_RUNS = 8
"""Most runs of a row that are looked at."""

_SPANS = np.array([1.0, 1.0, 2.0, 2.0, 2.0])
"""What of shift right and down (body heights), width, height and slant moves the rim of a body
about as far as one body height of shift."""

_STEP, _FARTHEST = 0.02, 0.15
"""First step and largest change of each, in these spans."""

_HALVINGS = 2
"""How often the steps are halved."""

_EVERY = 3
"""Every third row is enough for the fit."""


def align(
    template: NDArray[np.uint8],
    likelihood: NDArray[np.uint8],
    body: BodyFrame,
) -> tuple[NDArray[np.uint8], BodyFrame]:
    """
    Return a template laid more closely onto the likelihood, and the body there.

    :param template: (h, w) uint8, the placed template in a window, 255 inside.
    :param likelihood: (h, w) uint8, 255 = surely person.
    :param body: the body in the window's pixels.
    :returns: (h, w) uint8, soft edge, and the body in the window's pixels.
    """
    # One compiled version for parts of images and whole ones.
    template, likelihood = np.ascontiguousarray(template), np.ascontiguousarray(likelihood)
    height, width = template.shape
    sums = np.empty((height, width + 1), np.int32)
    runs = np.empty((height, _RUNS, 2), np.int32)
    counts = np.empty(height, np.int32)
    _prepare(template, likelihood, sums, runs, counts)
    unit = body.height
    spans = _SPANS * np.array([unit, unit, 1.0, 1.0, 1.0])
    center = (float(body.center_x), float(body.center_y))
    right, down, wider, taller, slant = _search(sums, runs, counts, center, spans).tolist()
    wide, tall = 1 + wider, 1 + taller
    turn = np.array([[wide, slant * tall], [0, tall]])
    middle = np.array(center)
    # From the middle of a pixel to the middle of a pixel.
    offset = middle + np.array([right, down]) - turn @ (middle - 0.5) - 0.5
    moved = cv2.warpAffine(
        template,
        np.column_stack([turn, offset]),
        (width, height),
        flags=cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )
    place = BodyFrame(center[0] + right, center[1] + down, unit * tall, body.angle)
    return np.asarray(moved), place


@kernel('u1[:,::1], u1[:,::1], i4[:,::1], i4[:,:,::1], i4[::1]')
def _prepare(
    template: NDArray[np.uint8],
    likelihood: NDArray[np.uint8],
    sums: NDArray[np.int32],
    runs: NDArray[np.int32],
    counts: NDArray[np.int32],
) -> None:
    """Sum up the likelihood (-255..255) along rows, and find the runs of the template."""
    height, width = template.shape
    for row in range(height):
        total = np.int32(0)
        sums[row, 0] = 0
        count = 0
        inside = False
        for col in range(width):
            total += 2 * np.int32(likelihood[row, col]) - 255
            sums[row, col + 1] = total
            solid = template[row, col] > 127
            if solid and not inside and count < _RUNS:
                runs[row, count, 0] = col
                inside = True
            elif inside and not solid:
                runs[row, count, 1] = col
                count += 1
                inside = False
        if inside:
            runs[row, count, 1] = width
            count += 1
        counts[row] = count


@kernel()
def _gain(
    sums: NDArray[np.int32],
    runs: NDArray[np.int32],
    counts: NDArray[np.int32],
    center: tuple[float, float],
    change: NDArray[np.float64],
) -> float:
    """Return the sum of the likelihood inside the template, of some of the rows."""
    height, width = sums.shape[0], sums.shape[1] - 1
    x, y = center
    wide, tall = 1 + change[2], 1 + change[3]
    total = 0
    for row in range(0, height, _EVERY):
        down = row + 0.5 - y - change[1]
        # What goes on beyond the window is thought to go on unchanged.
        source = min(max(int(np.floor(y + down / tall)), 0), height - 1)
        shift = x + change[0] + change[4] * down - x * wide + 0.5
        for k in range(counts[source]):
            first, last = runs[source, k, 0], runs[source, k, 1]
            if first > 0:
                first = min(max(int(shift + first * wide), 0), width)
            if last < width:
                last = min(max(int(shift + last * wide), 0), width)
            total += sums[row, last] - sums[row, first]
    return float(total)


@kernel('i4[:,::1], i4[:,:,::1], i4[::1], UniTuple(f8, 2), f8[::1]')
def _search(
    sums: NDArray[np.int32],
    runs: NDArray[np.int32],
    counts: NDArray[np.int32],
    center: tuple[float, float],
    spans: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Climb along one axis after the other, in steps that get smaller."""
    best = np.zeros(5)
    most = _gain(sums, runs, counts, center, best)
    step = _STEP * spans
    halved = 0
    while True:
        better = False
        for axis in range(5):
            for sign in (-1.0, 1.0):
                while True:
                    before = best[axis]
                    best[axis] += sign * step[axis]
                    gain = -np.inf
                    if abs(best[axis]) <= _FARTHEST * spans[axis]:
                        gain = _gain(sums, runs, counts, center, best)
                    if gain <= most:
                        best[axis] = before
                        break
                    most = gain
                    better = True
        if not better:
            if halved == _HALVINGS:
                break
            step /= 2
            halved += 1
    return best
