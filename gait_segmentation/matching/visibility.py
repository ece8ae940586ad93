# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How much of every template lies on known pixels, for every window."""

from __future__ import annotations

from copy import copy

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.matching.builds import BuildKernels
from gait_segmentation.matching.tanimoto import WindowGrid

__all__ = ['VisibleAreas']


class VisibleAreas:
    """
    Areas of templates over the known pixels, G where something is unknown.

    Nearly always what is unknown is beyond one side of the image, or two opposite ones: whole
    rows or whole columns.  The areas then follow from running sums of the templates' rows or
    columns.  In all other cases they are the common areas with the mask, as costly as those with
    a likelihood.
    """

    def __init__(
        self, kernels: BuildKernels, templates: NDArray[np.uint8], windows: WindowGrid
    ) -> None:
        """
        Sum up the templates.

        :param templates: (V, P, H, W) uint8, those of the kernels.
        """
        self._kernels = kernels
        self._windows = windows
        rows = kernels.new_rows(0).shape[1]
        self._sums = tuple(np.zeros((rows, size + 1), np.int32) for size in templates.shape[2:])
        for sums, axis in zip(self._sums, (3, 2), strict=True):
            lines = templates.sum(axis=axis, dtype=np.int32)
            sums[kernels.row, 1:] = np.cumsum(lines, axis=2, dtype=np.int32)
        self._result = kernels.new_rows(0)

    def of(self, kernels: BuildKernels) -> VisibleAreas:
        """Return the same for a copy of the kernels."""
        other = copy(self)
        other._kernels, other._result = kernels, kernels.new_rows(0)
        return other

    def rows(
        self, known: NDArray[np.uint8], active: NDArray[np.bool_], of_sequence: NDArray[np.intp]
    ) -> NDArray[np.int32]:
        """
        Return the area of each template over the known pixels of each window.

        :param known: (S, height, width) uint8 of the grid's padded size, 255 where known, else 0.
        :param active: (builds,) bool, builds that are wanted; the others' rows are undefined.
        :param of_sequence: (V,) build of each sequence.
        :returns: (S, R, pitch) int32 as from :meth:`BuildKernels.new_rows`; the next call
            overwrites it.
        """
        if len(self._result) != len(known):
            self._result = self._kernels.new_rows(len(known))
        wanted = self._kernels.row[active[of_sequence]]
        part = slice(int(wanted.min()), int(wanted.max()) + 1)
        lines = _whole_lines(known)
        if lines is None:
            self._kernels.common_rows(known, active, self._result)
            return self._result
        axis, spans = lines
        grid = self._windows
        for image, span in zip(self._result, spans, strict=True):
            _spread(
                self._sums[axis][part],
                span,
                axis == 1,
                grid.rows,
                grid.columns,
                grid.step,
                image[part],
            )
        return self._result


def _whole_lines(known: NDArray[np.uint8]) -> tuple[int, NDArray[np.int64]] | None:
    """
    Return between which rows all is known, or between which columns.

    :returns: 0 for rows or 1 for columns, and (S, 2) int64, the first one known and the first
        one after that not; None if the known is something else.
    """
    for axis in (0, 1):
        lines = known[:, :, 0] if axis == 0 else known[:, 0]
        if not (known == np.expand_dims(lines, 2 - axis)).all():
            continue
        spans = np.zeros((len(known), 2), np.int64)
        for span, line in zip(spans, lines, strict=True):
            places = np.flatnonzero(line)
            if len(places):
                span[:] = places[0], places[-1] + 1
        if (spans[:, 1] - spans[:, 0] == np.count_nonzero(lines, axis=1)).all():
            return axis, spans
    return None


@njit(cache=True, nogil=True)
def _spread(sums, span, by_column, rows, columns, step, out):  # type: ignore[no-untyped-def]
    """Give every window the area of its row, or of its column, between the lines of a span."""
    last = sums.shape[1] - 1
    lines = columns if by_column else rows
    low, high = np.empty(lines, np.int64), np.empty(lines, np.int64)
    for line in range(lines):
        low[line] = min(max(span[0] - line * step, 0), last)
        high[line] = min(max(span[1] - line * step, low[line]), last)
    areas = np.empty(lines, np.int32)
    for k in range(len(sums)):
        for line in range(lines):
            areas[line] = sums[k, high[line]] - sums[k, low[line]]
        for row in range(rows):
            for column in range(columns):
                out[k, row * columns + column] = areas[column if by_column else row]
