# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The placements that are searched in a frame."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ['Place', 'SearchRange']

Place = tuple[int, int, int]
"""Body height, row and column of a placement."""


class SearchRange(NamedTuple):
    """
    A box of placements: body heights, rows and columns from ``first`` on, ``shape`` of each.

    Placements in it have *lanes*, columns running fastest.
    """

    first: Place
    shape: Place

    @property
    def heights(self) -> slice:
        """Return the body heights."""
        return slice(self.first[0], self.first[0] + self.shape[0])

    @property
    def rows(self) -> slice:
        """Return the rows."""
        return slice(self.first[1], self.first[1] + self.shape[1])

    @property
    def columns(self) -> slice:
        """Return the columns."""
        return slice(self.first[2], self.first[2] + self.shape[2])

    @property
    def size(self) -> int:
        """Return the number of placements."""
        scales, rows, columns = self.shape
        return scales * rows * columns

    def lane(self, scale: int, row: int, column: int) -> int | None:
        """Return the lane of a placement, None if it is not in the range."""
        scales, rows, columns = self.shape
        scale, row, column = scale - self.first[0], row - self.first[1], column - self.first[2]
        if not (0 <= scale < scales and 0 <= row < rows and 0 <= column < columns):
            return None
        return (scale * rows + row) * columns + column

    def place(self, lane: int) -> Place:
        """Return the placement of a lane."""
        scale, rest = divmod(lane, self.shape[1] * self.shape[2])
        row, column = divmod(rest, self.shape[2])
        return self.first[0] + scale, self.first[1] + row, self.first[2] + column

    def about(self, place: Place, reach: Place) -> SearchRange:
        """
        Return the part of this range about a placement, of the same size wherever that is.

        :param reach: how many placements to either side it has, as far as there are as many.
        """
        shape = tuple(min(2 * r + 1, n) for r, n in zip(reach, self.shape, strict=True))
        first = tuple(
            min(max(at - r, start), start + whole - part)
            for at, r, start, whole, part in zip(
                place, reach, self.first, self.shape, shape, strict=True
            )
        )
        return SearchRange((first[0], first[1], first[2]), (shape[0], shape[1], shape[2]))

    def part(self, values: NDArray[np.int16], inner: SearchRange) -> NDArray[np.int16]:
        """
        Return the values of a range that is a part of this one.

        :param values: (R, n) int16 of all placements of this range.
        :param inner: the other range.
        :returns: (R, m) int16.
        """
        scale, row, column = (a - b for a, b in zip(inner.first, self.first, strict=True))
        scales, rows, columns = inner.shape
        part = values.reshape(len(values), *self.shape)[
            :, scale : scale + scales, row : row + rows, column : column + columns
        ]
        return part.reshape(len(values), -1)
