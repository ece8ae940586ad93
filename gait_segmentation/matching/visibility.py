# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Known pixels that are whole rows or whole columns, and the areas of templates between them.

Nearly always what is unknown is beyond one side of the image, or two opposite ones.  The area of
a template over the known pixels then follows from running sums of its rows or its columns.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.kernels import kernel

__all__ = ['KnownLines', 'LineSums']


@dataclass(frozen=True)
class KnownLines:
    """
    Between which rows (``axis`` 0) or columns (1) of each image all is known, and nothing else.

    ``spans`` is (S, 2) int64, the first line that is known and the first one after that is not.
    """

    axis: int
    spans: NDArray[np.int64]

    @classmethod
    def of(cls, known: NDArray[np.uint8]) -> KnownLines | None:
        """
        Return the lines of a mask, None if it is something else.

        :param known: (S, height, width) uint8, 255 where known, else 0.
        """
        spans = np.empty((len(known), 2), np.int64)
        for axis, find in enumerate((_row_spans, _column_spans)):
            if find(known, spans):
                return cls(axis, spans)
        return None


class LineSums:
    """Running sums over the rows and over the columns of templates."""

    def __init__(self, templates: NDArray[np.uint8], row: NDArray[np.int32], rows: int) -> None:
        """
        Sum up the templates.

        :param templates: (V, P, H, W) uint8.
        :param row: (V, P), where a template's sums go; equal templates share them.
        :param rows: R, how many different ones there are.
        """
        self._sums = tuple(np.zeros((rows, size + 1), np.int32) for size in templates.shape[2:])
        for sums, axis in zip(self._sums, (3, 2), strict=True):
            lines = templates.sum(axis=axis, dtype=np.int32)
            sums[row, 1:] = np.cumsum(lines, axis=2, dtype=np.int32)

    @property
    def whole(self) -> NDArray[np.int32]:
        """Return G, (R,) int32, the area of each template."""
        return self._sums[0][:, -1]

    def over(self, axis: int) -> NDArray[np.int32]:
        """Return the sums of the first 0, 1, 2, ... rows (``axis`` 0) or columns (1), (R, n)."""
        return self._sums[axis]


@kernel('u1[:,:,::1], i8[:,::1]')
def _row_spans(known, spans):  # type: ignore[no-untyped-def]
    """Find between which rows all is known; return False if that does not tell the mask."""
    line = np.empty(known.shape[1], np.uint8)
    for scale in range(len(known)):
        for y in range(known.shape[1]):
            line[y] = known[scale, y, 0]
            if not _all_are(known[scale, y], line[y]):
                return False
        if not _span(line, spans[scale]):
            return False
    return True


@kernel('u1[:,:,::1], i8[:,::1]')
def _column_spans(known, spans):  # type: ignore[no-untyped-def]
    """Do the same for columns."""
    for scale in range(len(known)):
        line = known[scale, 0]
        for y in range(1, known.shape[1]):
            if not _equal(known[scale, y], line):
                return False
        if not _span(line, spans[scale]):
            return False
    return True


@kernel()
def _all_are(line, value):  # type: ignore[no-untyped-def]
    differ = np.uint8(0)
    for x in range(len(line)):
        differ |= line[x] ^ value
    return differ == 0


@kernel()
def _equal(line, other):  # type: ignore[no-untyped-def]
    differ = np.uint8(0)
    for x in range(len(line)):
        differ |= line[x] ^ other[x]
    return differ == 0


@kernel()
def _span(line, span):  # type: ignore[no-untyped-def]
    """Find the first element that is set and the first one after that is not, if that is all."""
    first, last, count = len(line), 0, 0
    for x in range(len(line)):
        if line[x]:
            first, last, count = min(first, x), x + 1, count + 1
    span[0], span[1] = (first, last) if count else (0, 0)
    return count == 0 or last - first == count
