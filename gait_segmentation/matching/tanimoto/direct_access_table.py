# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's kernel: sorted templates, and where each value of the likelihood splits them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.kernels import kernel
from gait_segmentation.matching.tanimoto.kernel import CommonAreas, Images, Place, Shape

__all__ = ['DirectAccessTableKernel', 'splitting_ids']


class DirectAccessTableKernel(CommonAreas):
    """
    The sorted direct access tables of the paper.

    The templates' values at a pixel are sorted once.  For each value v that the likelihood can
    have there, a table gives how many templates are not above v: these add their own value to
    their sums, all others add v, and nothing is compared while matching.  Templates that are
    black at a pixel come first in its order and are passed over.  Each pixel still adds to every
    other template, so the time grows with their number.

    Wang, Yagi and Makihara, ACCV 2009, section 3.  The paper has two splitting IDs, of which one
    is enough: see :func:`splitting_ids`.
    """

    def _code(self, templates: Images) -> NDArray[np.int32]:
        grid = self._grid
        used = np.flatnonzero(templates.any(axis=0))
        order = np.argsort(templates[:, used], axis=0, kind='stable')
        values = np.take_along_axis(templates[:, used], order, axis=0)
        self._order = np.ascontiguousarray(order.T.astype(np.uint32))
        self._values = np.ascontiguousarray(values.T)
        self._split = splitting_ids(self._values)[1]
        self._pixels = np.column_stack(np.divmod(used, grid.width)).astype(np.int64)
        return np.arange(len(templates), dtype=np.int32)

    def _fill(
        self, images: Images, first: Place, windows: Shape, matrix: Images, out: NDArray[np.int32]
    ) -> None:
        step = self._grid.step
        corner = first[0] * step, first[1] * step
        _add_up(
            images,
            self._pixels,
            self._order,
            self._values,
            self._split,
            corner,
            step,
            windows,
            out,
        )


def splitting_ids(values: NDArray[np.uint8]) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """
    Return both splitting IDs for every pixel and value v.

    The templates between them are those whose value is v.  There a template's own value and v
    are the same number, so that any split from the first ID to the second gives the same sums.

    :param values: (pixels, K) uint8, ascending in each row.
    :returns: the number of templates below v, and of those not above it; (pixels, 256) int32.
    """
    count = np.zeros((len(values), 257), np.int32)
    np.add.at(count, (np.arange(len(values))[:, None], values.astype(np.intp) + 1), 1)
    below = np.cumsum(count, axis=1, dtype=np.int32)
    return np.ascontiguousarray(below[:, :-1]), np.ascontiguousarray(below[:, 1:])


@kernel(
    'u1[:,:,::1], i8[:,::1], u4[:,::1], u1[:,::1], i4[:,::1], UniTuple(i8, 2), i8, '
    'UniTuple(i8, 3), i4[:,::1]'
)
def _add_up(  # type: ignore[no-untyped-def]
    images, pixels, order, values, split, corner, step, windows, out
):
    """
    Put the common areas of all templates into ``out``, from its second row on.

    :param pixels: (A, 2) int64, row and column of the pixels that any template uses.
    :param order: (A, R) uint32, templates in the order of their ``values`` (A, R) uint8.
    :param split: (A, 256) int32, how many of them are not above a value of the likelihood.
    :param corner: row and column of the first window's first pixel.
    """
    templates = order.shape[1]
    count, rows, columns = windows
    # Window by window, so that what a pixel adds to lies together.
    totals = np.zeros((count * rows * columns, templates), np.int32)
    for pixel in range(len(pixels)):
        top, left = corner[0] + pixels[pixel, 0], corner[1] + pixels[pixel, 1]
        order_here, values_here, split_here = order[pixel], values[pixel], split[pixel]
        black = split_here[0]
        lane = 0
        for image in range(count):
            for row in range(rows):
                line = images[image, top + row * step]
                for column in range(columns):
                    value = line[left + column * step]
                    total = totals[lane]
                    lane += 1
                    if value == 0:
                        continue
                    middle = split_here[value]
                    for rank in range(black, middle):
                        total[order_here[rank]] += values_here[rank]
                    for rank in range(middle, templates):
                        total[order_here[rank]] += value
    for lane in range(len(totals)):
        for template in range(templates):
            out[template + 1, lane] = totals[lane, template]
