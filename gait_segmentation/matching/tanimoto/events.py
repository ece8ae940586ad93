# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The production kernel: templates as changes against their parents."""

from __future__ import annotations

import math
from copy import copy
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.matching.tanimoto.loops import LANES, RUN, gather, run_program
from gait_segmentation.matching.tanimoto.program import in_order, make_program
from gait_segmentation.matching.tanimoto.windows import WindowGrid, check_templates

__all__ = ['EventKernel', 'pitch_of', 'polyphase']

_CACHE_LINE = 64


class EventKernel:
    """
    Common areas by adding up what changes from one template to the next.

    C(child) = C(parent) + sum over the pixels in which they differ of
    min(v, g_child) - min(v, g_parent), where the parents form a minimum spanning arborescence
    from the empty template.  The pixels that ever change are gathered with the windows, also of
    several images, side by side, so that one event is a handful of vector additions for 192 of
    them.

    The number of events of binary templates sampled from a closed motion tends to a constant, the
    number of times the pixels flip during the motion, however finely the motion is sampled.
    Writing a result for each template and window remains; equal templates, as the half-cycle
    twins of a profile, share theirs.
    """

    def __init__(self, templates: NDArray[np.uint8], grid: WindowGrid) -> None:
        """
        Code the templates.

        :param templates: (K, height, width) uint8; the fewer grey levels, the faster.
        :raises InputError: if they do not fit the grid.
        """
        check_templates(templates, grid)
        self._grid = grid
        pixels = templates.reshape(len(templates), -1)
        different, first, row = np.unique(
            np.ascontiguousarray(pixels).view(np.dtype((np.void, pixels.shape[1]))),
            return_index=True,
            return_inverse=True,
        )
        self.rows = len(different)
        program, place = in_order(make_program(templates[first]))
        self.row: NDArray[np.int32] = place[row.reshape(-1)]
        self._matrix = _aligned((len(program.pixels) + 1) * LANES)
        self._origins = _origins(program.pixels, grid)
        self._program = program

    def copy(self) -> EventKernel:
        """Return a kernel of the same templates that works in memory of its own."""
        other = copy(self)
        other._matrix = _aligned(len(self._matrix))
        return other

    @property
    def events(self) -> int:
        """Return the number of events of all templates."""
        return self._program.events

    @property
    def nbytes(self) -> int:
        """Return the memory the coded templates and the gathered windows take, in bytes."""
        return self._program.nbytes + self._matrix.nbytes

    def common_area(self, images: NDArray[np.uint8]) -> NDArray[np.int32]:
        """
        Return C = sum of min(likelihood, template) for every template and window.

        :param images: (S, *grid.image_shape) uint8.
        :returns: (K, S, rows, columns) int32, valid until the next call.
        :raises InputError: if the images do not fit the grid.
        """
        grid = self._grid
        grid.check(images)
        windows = len(images), grid.rows, grid.columns
        rows = self.common_rows(polyphase(images, grid), (0, 0), windows)
        return rows[self.row][:, : math.prod(windows)].reshape(-1, *windows)

    def common_rows(
        self,
        planes: NDArray[np.uint8],
        first: tuple[int, int],
        windows: tuple[int, int, int],
        out: NDArray[np.int32] | None = None,
    ) -> NDArray[np.int32]:
        """
        Return the same for some of the windows; equal templates share a row, filled up.

        :param planes: from :func:`polyphase`.
        :param first: row and column of the first window.
        :param windows: number of images, rows and columns.
        :param out: from :meth:`new_rows`, of this kernel or one with more rows, to work in.
        :returns: (R, N) int32, a view of ``out``, C of template k in row ``row[k]``, image by
            image and row by row; what follows, up to :func:`pitch_of` them, is undefined.
        """
        program = self._program
        if out is None:
            out = self.new_rows(math.prod(windows))
        flat, stride = out.reshape(-1), out.shape[1]
        plane = planes.reshape(-1)[first[0] * _plane_shape(self._grid)[1] + first[1] :]
        for block, (places, offsets) in enumerate(_runs(self._grid, windows)):
            gather(plane, self._origins, places, offsets, self._matrix)
            run_program(
                self._matrix,
                program.source,
                program.lo,
                program.span,
                program.bounds,
                program.target,
                program.base,
                flat,
                stride,
                block * LANES,
            )
        return out[1 : self.rows + 1]

    def new_rows(self, windows: int) -> NDArray[np.int32]:
        """Return an array for ``out`` of :meth:`common_rows`; its first row must stay zero."""
        return np.zeros((self.rows + 1, pitch_of(windows)), np.int32)


def pitch_of(windows: int) -> int:
    """Return how long a row of a number of windows is when it is filled up."""
    return -(-windows // LANES) * LANES


def _aligned(size: int) -> NDArray[np.uint8]:
    """Return zeros that start at a cache line, so that no row of lanes needs one more."""
    memory = np.zeros(size + _CACHE_LINE, np.uint8)
    first = -memory.ctypes.data % _CACHE_LINE
    return memory[first : first + size]


def _plane_shape(grid: WindowGrid) -> tuple[int, int]:
    """Return rows and columns of a plane, with room to read a run from its last pixel."""
    height, width = grid.image_shape
    return -(-height // grid.step) + 1, -(-width // grid.step) + RUN


def _origins(pixels: NDArray[np.int64], grid: WindowGrid) -> NDArray[np.int64]:
    """Return where in the planes the pixels of the first window are."""
    rows, columns = _plane_shape(grid)
    y, x = np.divmod(pixels, grid.width)
    phase = (y % grid.step) * grid.step + x % grid.step
    return np.asarray((phase * rows + y // grid.step) * columns + x // grid.step)


@lru_cache(maxsize=16)
def _runs(
    grid: WindowGrid, windows: tuple[int, int, int]
) -> list[tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """
    Return the runs of each block of windows: lane in the block, and offset in the planes.

    :param windows: numbers of images, rows and columns.
    """
    planes, (height, width) = grid.step**2, _plane_shape(grid)
    images, rows, columns = windows
    blocks = []
    for start in range(0, images * rows * columns, LANES):
        last = min(start + LANES, images * rows * columns)
        places, offsets, window = [], [], start
        while window < last:
            line, column = divmod(window, columns)
            image, row = divmod(line, rows)
            places.append(window - start)
            offsets.append((image * planes * height + row) * width + column)
            window += min(RUN, columns - column)
        blocks.append((np.array(places, np.int64), np.array(offsets, np.int64)))
    return blocks


def polyphase(images: NDArray[np.uint8], grid: WindowGrid) -> NDArray[np.uint8]:
    """
    Sort the pixels by their remainders modulo the step, so that windows are contiguous.

    :param images: (S, height, width) uint8.
    :returns: (S, size) uint8, for each image step x step planes one after the other.
    """
    step = grid.step
    planes = np.zeros((len(images), step * step, *_plane_shape(grid)), np.uint8)
    for y in range(step):
        for x in range(step):
            part = images[:, y::step, x::step]
            planes[:, y * step + x, : part.shape[1], : part.shape[2]] = part
    return planes.reshape(len(images), -1)
