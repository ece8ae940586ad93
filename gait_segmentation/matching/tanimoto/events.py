# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The production kernel: templates as changes against their parents."""

from __future__ import annotations

from copy import copy

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.matching.tanimoto.program import in_order, make_program
from gait_segmentation.matching.tanimoto.simd import LANES, RUN, gather, run_program
from gait_segmentation.matching.tanimoto.windows import WindowGrid, check_templates

__all__ = ['EventKernel', 'polyphase']

_CACHE_LINE = 64


class EventKernel:
    """
    Common areas by adding up what changes from one template to the next.

    C(child) = C(parent) + sum over the pixels in which they differ of
    min(v, g_child) - min(v, g_parent), where the parents form a minimum spanning arborescence
    from the empty template.  For each scale the pixels that ever change are gathered with all
    windows side by side, so that one event is a handful of vector additions for 128 windows.

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
        windows = grid.rows * grid.columns
        self._blocks = -(-windows // LANES)
        self.pitch = self._blocks * LANES
        self._matrix = _aligned((len(program.pixels) + 1) * LANES)
        self._origins = _origins(program.pixels, grid)
        self._program = program
        self._runs = [_runs(grid, block * LANES) for block in range(self._blocks)]
        self._result = np.zeros((0, 0, 0), np.int32)

    def copy(self) -> EventKernel:
        """Return a kernel of the same templates that works in memory of its own."""
        other = copy(self)
        other._matrix = _aligned(len(self._matrix))
        other._result = np.zeros((0, 0, 0), np.int32)
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
        """Return C for every template and window, see :class:`Kernel`."""
        grid = self._grid
        rows = self.common_rows(images)[:, self.row, : grid.rows * grid.columns]
        return rows.swapaxes(0, 1).reshape(len(self.row), len(images), grid.rows, grid.columns)

    def common_rows(self, images: NDArray[np.uint8]) -> NDArray[np.int32]:
        """
        Return the same as it is computed: equal templates share a row of windows, filled up.

        :param images: (S, height, width) uint8 of the grid's padded size.
        :returns: (S, R, pitch) int32, C of template k in row ``row[k]``; what follows after rows *
            columns is undefined.  Valid until the next call.
        :raises InputError: if the images do not fit the grid.
        """
        self._grid.check(images)
        if len(self._result) != len(images):
            self._result = np.zeros((len(images), self.rows + 1, self.pitch), np.int32)
        for plane, out in zip(polyphase(images, self._grid), self._result, strict=True):
            self.fill_rows(plane, out)
        return self._result[:, 1:]

    def fill_rows(self, plane: NDArray[np.uint8], out: NDArray[np.int32]) -> None:
        """
        Compute the rows of one image.

        :param plane: one image of :func:`polyphase`.
        :param out: from :meth:`new_rows`, of this kernel or one with more rows; row 0 stays zero
            and C of template k goes to row ``row[k] + 1``.
        """
        program = self._program
        for block in range(self._blocks):
            places, offsets = self._runs[block]
            gather(plane, self._origins, places, offsets, self._matrix)
            run_program(
                self._matrix,
                program.source,
                program.lo,
                program.span,
                program.bounds.reshape(-1),
                program.target,
                program.base,
                out.reshape(-1),
                self.pitch,
                block * LANES,
            )

    def new_rows(self) -> NDArray[np.int32]:
        """Return an array for ``out`` of :meth:`fill_rows`."""
        return np.zeros((self.rows + 1, self.pitch), np.int32)


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


def _runs(grid: WindowGrid, first: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the runs of a block of windows: lane in the block, and offset in the planes."""
    pitch = _plane_shape(grid)[1]
    last = min(first + LANES, grid.rows * grid.columns)
    places, offsets, window = [], [], first
    while window < last:
        row, column = divmod(window, grid.columns)
        places.append(window - first)
        offsets.append(row * pitch + column)
        window += min(RUN, grid.columns - column)
    return np.array(places, np.int64), np.array(offsets, np.int64)


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
