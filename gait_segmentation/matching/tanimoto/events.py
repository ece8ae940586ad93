# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The default kernel: templates as changes against their parents."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.kernels import kernel
from gait_segmentation.matching.tanimoto.kernel import LANES, CommonAreas, Images, Place, Shape
from gait_segmentation.matching.tanimoto.program import PAIR, make_program
from gait_segmentation.matching.tanimoto.windows import WindowGrid

__all__ = ['EventKernel']

_RUN, _WORD = 16, 8
"""Bytes that are copied at once, and bytes of a number by which they are."""
_CACHE_LINE = 64


class EventKernel(CommonAreas):
    """
    Common areas by adding up what changes from one template to the next.

    C(child) = C(parent) + sum over the pixels in which they differ of
    min(v, g_child) - min(v, g_parent), where the parents form a minimum spanning arborescence
    from the empty template.  The pixels that ever change are gathered with the windows, also of
    several images, side by side, so that one event is a handful of vector additions for 160 of
    them.

    The number of events of binary templates sampled from a closed motion tends to a constant, the
    number of times the pixels flip during the motion, however finely the motion is sampled.
    Writing a result for each template and window remains; equal templates, as the half-cycle
    twins of a profile, share theirs.
    """

    def _code(self, templates: Images) -> NDArray[np.int32]:
        grid = self._grid
        self._program = make_program(templates.reshape(-1, grid.height, grid.width))
        self._origins = _origins(self._program.pixels, grid)
        return self._program.row

    @property
    def events(self) -> int:
        """Return the number of events of all templates."""
        return self._program.events

    @property
    def nbytes(self) -> int:
        """Return the memory the coded templates and the gathered windows take, in bytes."""
        return self._program.nbytes + self.new_matrix().nbytes

    def _fill(
        self, images: Images, first: Place, windows: Shape, matrix: Images, out: NDArray[np.int32]
    ) -> None:
        program = self._program
        flat, stride = out.reshape(-1), out.shape[1]
        planes = _polyphase(images, self._grid)
        plane = planes.reshape(-1)[first[0] * _plane_shape(self._grid)[1] + first[1] :]
        for block, (places, offsets) in enumerate(_runs(self._grid, windows)):
            _gather(_words(plane), self._origins, places, offsets, _words(matrix))
            _run_program(
                matrix,
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

    def new_matrix(self) -> NDArray[np.uint8]:
        """Return an array for ``matrix`` of :meth:`common_rows`, with a run to spare."""
        size = (len(self._program.pixels) + 1) * LANES
        memory = np.zeros(size + _CACHE_LINE, np.uint8)
        # From a cache line on, so that no row of lanes needs one more.
        first = -memory.ctypes.data % _CACHE_LINE
        return memory[first : first + size]


def _plane_shape(grid: WindowGrid) -> tuple[int, int]:
    """Return rows and columns of a plane, with room to read a run from its last pixel."""
    height, width = grid.image_shape
    return -(-height // grid.step) + 1, -(-width // grid.step) + _RUN


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
            window += min(_RUN, columns - column)
        blocks.append((np.array(places, np.int64), np.array(offsets, np.int64)))
    return blocks


def _polyphase(images: NDArray[np.uint8], grid: WindowGrid) -> NDArray[np.uint8]:
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


def _words(data: NDArray[np.uint8]) -> NDArray[np.uint64]:
    """Return the words that begin at each byte, which share their memory."""
    return np.ndarray((data.size - _WORD + 1,), np.uint64, data.data, strides=(1,))


@kernel('u8[:], i8[::1], i8[::1], i8[::1], u8[:]')
def _gather(plane, origins, places, offsets, matrix):  # type: ignore[no-untyped-def]
    """
    Put the windows of a block side by side for all pixels, run by run.

    :param plane: words of a flat image, its pixels ordered so that windows are contiguous.
    :param origins: (A,) int64, where in it the pixels of the first window are.
    :param places: (R,) int64 lanes at which the runs begin.
    :param offsets: (R,) int64, how far the runs' windows are from the first one.
    :param matrix: words of the result, ``LANES`` bytes a pixel and a run to spare.
    """
    for pixel in range(len(origins)):
        origin, row = origins[pixel], pixel * LANES
        for run in range(len(places)):
            target, source = row + places[run], origin + offsets[run]
            matrix[target] = plane[source]
            matrix[target + _WORD] = plane[source + _WORD]


@njit(nogil=True, inline='always')
def _change(value, lo, span):  # type: ignore[no-untyped-def]
    """Return what an event adds; unsigned, so that as many as possible are done at once."""
    return np.int16(min(np.uint8(max(value, lo) - lo), span))


@kernel('u1[::1], u2[::1], u1[::1], u1[::1], i4[:,::1], i4[::1], i4[::1], i4[::1], i8, i8')
def _run_program(  # type: ignore[no-untyped-def]
    matrix, source, lo, span, bounds, target, base, out, stride, first
):
    """
    Make the common areas of all templates for the gathered windows.

    :param matrix: flat uint8, ``LANES`` bytes for each pixel of the program.
    :param source: as the next five in :class:`EventProgram`.
    :param out: flat int32, rows of ``stride``; row 0 must be zero.
    :param first: where the windows' results begin in a row.
    """
    total = np.empty(LANES, np.int16)
    for step in range(len(target)):
        total[:] = 0
        for pair in range(bounds[step, 0], bounds[step, 2]):
            one, two = PAIR * pair, PAIR * pair + 1
            lo_one, span_one, lo_two, span_two = lo[one], span[one], lo[two], span[two]
            place = LANES * np.int64(source[one])
            values = matrix[place : place + LANES]
            place = LANES * np.int64(source[two])
            others = matrix[place : place + LANES]
            if pair < bounds[step, 1]:
                for lane in range(LANES):
                    change = _change(values[lane], lo_one, span_one)
                    total[lane] += change + _change(others[lane], lo_two, span_two)
            else:
                for lane in range(LANES):
                    change = _change(values[lane], lo_one, span_one)
                    total[lane] -= change + _change(others[lane], lo_two, span_two)
        old = out[base[step] * stride + first : base[step] * stride + first + LANES]
        new = out[target[step] * stride + first : target[step] * stride + first + LANES]
        for lane in range(LANES):
            new[lane] = old[lane] + total[lane]
