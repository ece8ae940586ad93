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

from gait_segmentation.segmentation.graph_cut import ALL_STEPS, CAPACITY

__all__ = ['contrast_links', 'distance_links']

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
    places: NDArray[np.int32],
    out: NDArray[np.int32],
) -> None:
    height, width = image.shape[:2]
    total = 0
    pairs = 0
    for row in range(height):
        for col in range(width):
            if given[row, col] != 0:
                continue
            for arc in range(8):
                next_row, next_col = row + steps[arc, 0], col + steps[arc, 1]
                if not (0 <= next_row < height and 0 <= next_col < width):
                    continue
                if arc < 4:
                    place = (arc * height + row) * width + col
                elif given[next_row, next_col] != 0:
                    place = ((arc - 4) * height + next_row) * width + next_col
                else:
                    continue
                square = 0
                for channel in range(3):
                    d = int(image[row, col, channel]) - int(image[next_row, next_col, channel])
                    square += d * d
                out[place] = square
                places[pairs] = place
                total += square
                pairs += 1
    if pairs == 0:
        return
    mean = total / pairs
    beta = 1 / (2 * mean) if total > 0 else 0.0
    to_table = beta * (table.size - 1) / _TABLE_END
    straight = weight * CAPACITY
    across = weight * CAPACITY / np.sqrt(2.0)
    for k in range(pairs):
        place = places[k]
        entry = min(int(out[place] * to_table), table.size - 1)
        out[place] = int((straight if place < 2 * height * width else across) * table[entry])


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
    places = np.empty(links.size, np.int32)
    _contrast(image, given, ALL_STEPS, weight, _EXP, places, links.reshape(-1))
    return links


@njit(cache=True, nogil=True)
def _distance(
    psi: NDArray[np.float32],
    given: NDArray[np.int8],
    steps: NDArray[np.int64],
    weight: float,
    links: NDArray[np.int32],
) -> None:
    height, width = psi.shape
    straight = weight * CAPACITY / 2
    across = weight * CAPACITY / (2 * np.sqrt(2.0))
    for row in range(height):
        for col in range(width):
            for arc in range(4):
                next_row, next_col = row + steps[arc, 0], col + steps[arc, 1]
                if next_row >= height or not 0 <= next_col < width:
                    continue
                if given[row, col] != 0 and given[next_row, next_col] != 0:
                    continue
                gain = straight if arc < 2 else across
                links[arc, row, col] += int(gain * (psi[row, col] + psi[next_row, next_col]))


def distance_links(
    psi: NDArray[np.float32],
    weight: float,
    links: NDArray[np.int32],
    given: NDArray[np.int8] | None = None,
) -> None:
    """
    Add the shape term to the n-links in place: (psi_p + psi_q) / (2 dist(p, q)) each.

    :param psi: (h, w) float32 >= 0, what a cut costs at each pixel.
    :param weight: its weight in the energy.
    :param links: (4, h, w) int32, added to.
    :param given: as for :func:`contrast_links`; links between two such pixels stay as they are.
    """
    if given is None:
        given = np.zeros(psi.shape, np.int8)
    _distance(psi, given, ALL_STEPS, weight, links)
