# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Common areas of all templates with all windows: what kernels share, and the paper's kernel."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.kernels import kernel

LANES = 160
"""
Windows that are treated at a time, to a multiple of which rows of results are filled up: an
ordinary search has 147.
"""

Images = NDArray[np.uint8]
Shape = tuple[int, int, int]


def pitch_of(windows: int) -> int:
    """Return how long a row of a number of windows is when it is filled up."""
    return -(-windows // LANES) * LANES


@dataclass(frozen=True)
class WindowGrid:
    """``rows`` x ``columns`` windows of ``height`` x ``width`` pixels, ``step`` pixels apart."""

    height: int
    width: int
    rows: int
    columns: int
    step: int = 1

    @property
    def image_shape(self) -> tuple[int, int]:
        """Return the (height, width) of a padded image."""
        return (
            self.height + (self.rows - 1) * self.step,
            self.width + (self.columns - 1) * self.step,
        )

    def part(self, row: int, column: int) -> tuple[slice, slice]:
        """Return the rows and columns of a padded image that a window has."""
        top, left = row * self.step, column * self.step
        return slice(top, top + self.height), slice(left, left + self.width)

    def areas(self, images: Images) -> NDArray[np.int32]:
        """
        Return the sums over all windows.

        :param images: (S, *self.image_shape) uint8.
        :returns: (S, rows, columns) int32.
        """
        sums = np.stack([cv2.integral(image) for image in images])
        rows = self.step * np.arange(self.rows)[:, None]
        columns = self.step * np.arange(self.columns)
        below, right = rows + self.height, columns + self.width
        return np.asarray(
            sums[:, below, right]
            - sums[:, below, columns]
            - sums[:, rows, right]
            + sums[:, rows, columns]
        )


class CommonAreas(ABC):
    """
    Computes C = sum of min(likelihood, template) for all templates and windows.

    Equal templates, such as the half-cycle twins of a profile, share a row: there are ``rows``;
    ``row`` (K,) int32 is that of each template, and ``area`` (R,) int32 the sums G over them.
    Nothing is written after making, so that matchers may share a kernel.
    """

    def __init__(self, templates: Images, grid: WindowGrid) -> None:
        """
        Code the templates.

        :param templates: (K, height, width) uint8; the fewer grey levels, the faster.
        """
        self._grid = grid
        pixels = np.ascontiguousarray(templates.reshape(len(templates), -1))
        different, first, row = np.unique(
            pixels.view(np.dtype((np.void, pixels.shape[1]))),
            return_index=True,
            return_inverse=True,
        )
        self.rows = len(different)
        place = self._code(pixels[first])
        self.row: NDArray[np.int32] = place[row.reshape(-1)]
        self.area = np.empty(self.rows, np.int32)
        self.area[self.row] = pixels.sum(axis=1)

    @abstractmethod
    def _code(self, templates: Images) -> NDArray[np.int32]:
        """
        Prepare what is compared.

        :param templates: (R, height x width) uint8, all different.
        :returns: (R,) int32, the row of each.
        """

    @abstractmethod
    def common_rows(
        self,
        images: Images,
        first: tuple[int, int],
        windows: Shape,
        matrix: Images,
        out: NDArray[np.int32],
    ) -> NDArray[np.int32]:
        """
        Return C for some of the windows.

        :param images: (S, *grid.image_shape) uint8, contiguous.
        :param first: row and column of the first window.
        :param windows: number of images, rows and columns.
        :param matrix: from :meth:`new_matrix`, and ``out`` from :meth:`new_rows`, to work in.
        :returns: (R, N) int32, a view of ``out``, C of template k in row ``row[k]``, image by
            image and row by row; what follows, up to :func:`pitch_of` them, is undefined.
        """

    def new_matrix(self) -> Images:
        """Return an array for ``matrix`` of :meth:`common_rows`, empty if none is needed."""
        return np.zeros(0, np.uint8)

    def new_rows(self, windows: int) -> NDArray[np.int32]:
        """Return an array for ``out`` of :meth:`common_rows`; its first row must stay zero."""
        return np.zeros((self.rows + 1, pitch_of(windows)), np.int32)


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
        used = np.flatnonzero(templates.any(axis=0))
        order = np.argsort(templates[:, used], axis=0, kind='stable')
        values = np.take_along_axis(templates[:, used], order, axis=0)
        self._order = np.ascontiguousarray(order.T.astype(np.uint32))
        self._values = np.ascontiguousarray(values.T)
        self._split = splitting_ids(self._values)[1]
        self._pixels = np.column_stack(np.divmod(used, self._grid.width)).astype(np.int64)
        return np.arange(len(templates), dtype=np.int32)

    def common_rows(
        self,
        images: Images,
        first: tuple[int, int],
        windows: Shape,
        matrix: Images,
        out: NDArray[np.int32],
    ) -> NDArray[np.int32]:
        """Add up what the tables say, pixel by pixel."""
        step = self._grid.step
        corner = first[0] * step, first[1] * step
        coded = self._pixels, self._order, self._values, self._split
        _add_up(images, *coded, corner, step, windows, out)
        return out[1:]


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
