# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the kernels have in common: common areas of all templates and windows."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.matching.tanimoto.windows import WindowGrid

__all__ = ['LANES', 'CommonAreas', 'Images', 'Place', 'Shape', 'pitch_of']

LANES = 160
"""
Windows that are treated at a time, to a multiple of which rows of results are filled up: an
ordinary search has 147.
"""

Images = NDArray[np.uint8]
Place = tuple[int, int]
Shape = tuple[int, int, int]


def pitch_of(windows: int) -> int:
    """Return how long a row of a number of windows is when it is filled up."""
    return -(-windows // LANES) * LANES


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
    def _fill(
        self, images: Images, first: Place, windows: Shape, matrix: Images, out: NDArray[np.int32]
    ) -> None:
        """Put C into all rows of ``out`` but the first; as :meth:`common_rows`."""

    def common_rows(
        self,
        images: Images,
        first: Place,
        windows: Shape,
        matrix: Images | None = None,
        out: NDArray[np.int32] | None = None,
    ) -> NDArray[np.int32]:
        """
        Return C for some of the windows.

        :param images: (S, *grid.image_shape) uint8, contiguous.
        :param first: row and column of the first window.
        :param windows: number of images, rows and columns.
        :param matrix: from :meth:`new_matrix`, and ``out`` from :meth:`new_rows`, of this kernel
            or a larger one, to work in.
        :returns: (R, N) int32, a view of ``out``, C of template k in row ``row[k]``, image by
            image and row by row; what follows, up to :func:`pitch_of` them, is undefined.
        """
        matrix = self.new_matrix() if matrix is None else matrix
        out = self.new_rows(math.prod(windows)) if out is None else out
        self._fill(images, first, windows, matrix, out)
        return out[1 : self.rows + 1]

    def common_area(self, images: Images) -> NDArray[np.int32]:
        """
        Return C for every template and window.

        :param images: (S, *grid.image_shape) uint8.
        :returns: (K, S, rows, columns) int32.
        """
        grid = self._grid
        windows = len(images), grid.rows, grid.columns
        rows = self.common_rows(images, (0, 0), windows)
        return rows[self.row][:, : math.prod(windows)].reshape(-1, *windows)

    def new_matrix(self) -> Images:
        """Return an array for ``matrix`` of :meth:`common_rows`, empty if none is needed."""
        return np.zeros(0, np.uint8)

    def new_rows(self, windows: int) -> NDArray[np.int32]:
        """Return an array for ``out`` of :meth:`common_rows`; its first row must stay zero."""
        return np.zeros((self.rows + 1, pitch_of(windows)), np.int32)
