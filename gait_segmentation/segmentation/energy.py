# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The pairwise terms of the energy (paper, Eq. 2): contrast and distance to the template's outline.

Contrast is that of Boykov and Jolly, exp(-beta |I_p - I_q|^2) / dist(p, q) with beta from the
mean contrast of the window; the shape term is that of Freedman and Zhang (CVPR 2005): a cut link
costs what it is away from the template's outline, saturated.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.segmentation.graph_cut import CAPACITY, NEIGHBOURS

__all__ = ['contrast_links', 'distance_links']

_STEPS = np.array(NEIGHBOURS, np.int64)
_TABLE_END = 8.0
_TABLE_SIZE = 1024
_EXP = np.exp(-np.linspace(0, _TABLE_END, _TABLE_SIZE, dtype=np.float32))


@njit(cache=True, nogil=True)
def _contrast(
    image: NDArray[np.uint8],
    given: NDArray[np.int8],
    steps: NDArray[np.int64],
    weight: float,
    table: NDArray[np.float32],
    out: NDArray[np.int32],
) -> None:
    height, width = image.shape[:2]
    total = 0
    pairs = 0
    for direction in range(4):
        d_row, d_col = steps[direction]
        for row in range(height - d_row):
            for col in range(max(0, -d_col), min(width, width - d_col)):
                if given[row, col] != 0 and given[row + d_row, col + d_col] != 0:
                    continue
                square = 0
                for channel in range(3):
                    d = int(image[row, col, channel]) - int(
                        image[row + d_row, col + d_col, channel]
                    )
                    square += d * d
                out[direction, row, col] = square
                total += square
                pairs += 1
    if pairs == 0:
        return
    mean = total / pairs
    beta = 1 / (2 * mean) if total > 0 else 0.0
    to_table = beta * (table.size - 1) / _TABLE_END
    for direction in range(4):
        d_row, d_col = steps[direction]
        gain = weight * CAPACITY / np.sqrt(d_row * d_row + d_col * d_col)
        for row in range(height - d_row):
            for col in range(max(0, -d_col), min(width, width - d_col)):
                if given[row, col] != 0 and given[row + d_row, col + d_col] != 0:
                    continue
                entry = min(int(out[direction, row, col] * to_table), table.size - 1)
                out[direction, row, col] = int(gain * table[entry])


def contrast_links(
    image: NDArray[np.uint8], weight: float, given: NDArray[np.int8]
) -> NDArray[np.int32]:
    """
    Return the contrast term of the n-links as integer capacity, (4, h, w) int32.

    :param image: (h, w, 3) uint8 in a space whose distances mean something (Lab or BGR).
    :param weight: its weight in the energy.
    :param given: (h, w) int8, non-zero where the label is given; links between two such pixels
        are left zero and do not count for the mean contrast.
    """
    links = np.zeros((4, *image.shape[:2]), np.int32)
    _contrast(image, given, _STEPS, weight, _EXP, links)
    return links


@njit(cache=True, nogil=True)
def _distance(
    psi: NDArray[np.float32], steps: NDArray[np.int64], weight: float, links: NDArray[np.int32]
) -> None:
    height, width = psi.shape
    for direction in range(4):
        d_row, d_col = steps[direction]
        gain = weight * CAPACITY / (2 * np.sqrt(d_row * d_row + d_col * d_col))
        for row in range(height - d_row):
            for col in range(max(0, -d_col), min(width, width - d_col)):
                links[direction, row, col] += int(
                    gain * (psi[row, col] + psi[row + d_row, col + d_col])
                )


def distance_links(psi: NDArray[np.float32], weight: float, links: NDArray[np.int32]) -> None:
    """
    Add the shape term to the n-links in place: (psi_p + psi_q) / (2 dist(p, q)) each.

    :param psi: (h, w) float32 >= 0, what a cut costs at each pixel.
    :param weight: its weight in the energy.
    :param links: (4, h, w) int32, added to.
    """
    _distance(psi, _STEPS, weight, links)
