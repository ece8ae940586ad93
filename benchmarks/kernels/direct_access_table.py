# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's kernel: sorted templates and two splitting IDs for every pixel and value."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.matching.tanimoto.windows import WindowGrid, check_templates

__all__ = ['DirectAccessTableKernel']


class DirectAccessTableKernel:
    """
    The direct access tables of the paper, to the letter.

    The templates' values at a pixel are sorted once.  For each value v that the likelihood can
    have there, a table gives two splitting IDs: the last rank whose template is not above v, and
    the first whose template is not below it.  Templates up to the first ID add their own value,
    templates from the second on add v, and nothing is compared while matching; where both hold,
    the two values are equal and are added once.  Each pixel still adds to every template, so the
    time grows with their number; kept as the published method to compare with.

    Wang, Yagi and Makihara, ACCV 2009, section 3.
    """

    def __init__(self, templates: NDArray[np.uint8], grid: WindowGrid) -> None:
        """
        Sort the templates and fill the tables.

        :param templates: (K, height, width) uint8.
        :raises InputError: if they do not fit the grid.
        """
        check_templates(templates, grid)
        self._grid = grid
        pixels = templates.reshape(len(templates), -1)
        order = np.argsort(pixels, axis=0, kind='stable')
        self._order = np.ascontiguousarray(order.T.astype(np.int32))
        self._sorted = np.ascontiguousarray(np.take_along_axis(pixels, order, axis=0).T)
        self._last, self._first = _splitting_ids(self._sorted)

    def common_area(self, images: NDArray[np.uint8]) -> NDArray[np.int32]:
        """Return C for every template and window, as :class:`EventKernel` does."""
        grid = self._grid
        grid.check(images)
        result = np.zeros((len(images), grid.rows, grid.columns, self._order.shape[1]), np.int32)
        _add_up(
            images,
            self._order,
            self._sorted,
            self._last,
            self._first,
            grid.step,
            grid.width,
            result,
        )
        return np.moveaxis(result, 3, 0)


def _splitting_ids(values: NDArray[np.uint8]) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """
    Return both splitting IDs for every pixel and value.

    :param values: (pixels, K) uint8, ascending in each row.
    :returns: number of templates <= v, and index of the first >= v; (pixels, 256) int32 each.
    """
    count = np.zeros((len(values), 257), np.int32)
    np.add.at(count, (np.arange(len(values))[:, None], values.astype(np.intp) + 1), 1)
    below = np.cumsum(count, axis=1, dtype=np.int32)
    return np.ascontiguousarray(below[:, 1:]), np.ascontiguousarray(below[:, :-1])


@njit(cache=True, nogil=True)
def _add_up(images, order, ascending, last, first, step, width, result):  # type: ignore[no-untyped-def]
    templates = order.shape[1]
    for scale in range(result.shape[0]):
        for row in range(result.shape[1]):
            for column in range(result.shape[2]):
                common = result[scale, row, column]
                for pixel in range(order.shape[0]):
                    y, x = pixel // width + row * step, pixel % width + column * step
                    value = images[scale, y, x]
                    split = last[pixel, value]
                    for rank in range(split):
                        common[order[pixel, rank]] += ascending[pixel, rank]
                    for rank in range(max(split, first[pixel, value]), templates):
                        common[order[pixel, rank]] += value
