# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The default kernel: templates as changes against their parents, added up by the vector unit."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.kernels import kernel
from gait_segmentation.matching.common_areas import CommonAreas, Images
from gait_segmentation.matching.placements import LANES, SearchRange, WindowGrid

_WORD = 8
"""Bytes that are copied at once."""
_CACHE_LINE = 64
_MOST = 255
"""What the events of a group change a sum by at most, which 8 bits can hold."""
_MOST_OF_STEP = 32767 // _MOST
"""Groups that a step has at most: what 16 bits can add up."""


@dataclass(frozen=True)
class EventProgram:
    """
    All templates of a bank, coded as changes.

    An *event* is a pixel in which a template differs from its parent, a there and b here.  It
    changes the common area by min(v, b) - min(v, a), which is min(max(v - lo, 0), span) with
    lo = min(a, b) and span = |b - a|, added if b > a and subtracted if not.

    ``pixels`` (A,) int64 are the pixels any event uses.  ``source`` (E,) uint16, or uint32 where
    there are many pixels, is an event's place in that list, ``lo`` and ``span`` (E,) are uint8.
    Group g has the events from ``groups[g]`` to ``groups[g + 1]``, (G + 1,) int32, all added or
    all subtracted, whose spans are at most 255 together.
    A step (``target``, ``base``, both (T,) int32) makes row ``target`` from row ``base``; row 0
    is the empty template, the others are in the order in which they are made, so that results are
    written one after the other: that of template k is ``row[k] + 1``, (K,) int32.  ``bounds``
    (T, 3) int32 are the groups at which its additions begin, its subtractions begin, and these
    end.
    """

    pixels: NDArray[np.int64]
    source: NDArray[np.uint16] | NDArray[np.uint32]
    lo: NDArray[np.uint8]
    span: NDArray[np.uint8]
    groups: NDArray[np.int32]
    target: NDArray[np.int32]
    base: NDArray[np.int32]
    bounds: NDArray[np.int32]
    row: NDArray[np.int32]


def make_program(templates: NDArray[np.uint8]) -> EventProgram:
    """
    Code templates as changes against their parents.

    :param templates: (K, height, width) uint8.
    """
    pixels = np.ascontiguousarray(templates.reshape(len(templates), -1))
    # Pixels that are in no template part none, and are more than half.
    used = np.flatnonzero(pixels.any(axis=0))
    pixels = np.ascontiguousarray(pixels[:, used])
    order, parents = minimum_arborescence(pixels)
    row = np.argsort(order).astype(np.int32)
    empty = np.zeros(len(used), np.uint8)
    events: list[tuple[NDArray[np.int64], NDArray[np.uint8], NDArray[np.uint8]]] = []
    groups: list[NDArray[np.int32]] = [np.zeros(1, np.int32)]
    steps: list[tuple[int, int, int, int, int]] = []
    end = count = 0
    for child in order.tolist():
        parent = parents[child]
        before, after = pixels[parent] if parent >= 0 else empty, pixels[child]
        start, middle = end, end
        for low, high in ((before, after), (after, before)):
            where = np.flatnonzero(high > low)
            span = high[where] - low[where]
            place, ends = grouped(span)
            events.append((where[place], low[where[place]], span[place]))
            groups.append(ends + np.int32(count))
            count += len(where)
            middle, end = end, end + len(ends)
        target, base = int(row[child]) + 1, int(row[parent]) + 1 if parent >= 0 else 0
        # A template that is its parent, too, has a step.
        for first in range(start, max(end, start + 1), _MOST_OF_STEP):
            last = min(first + _MOST_OF_STEP, end)
            steps.append((target, base, first, min(max(middle, first), last), last))
            base = target
    source, lo, span = (np.concatenate(each) for each in zip(*events, strict=True))
    table = np.array(steps, np.int32)
    return EventProgram(
        pixels=used,
        source=source.astype(np.uint16 if len(used) <= 2**16 else np.uint32),
        lo=lo,
        span=span,
        groups=np.concatenate(groups),
        target=table[:, 0].copy(),
        base=table[:, 1].copy(),
        bounds=table[:, 2:].copy(),
        row=row,
    )


@kernel('u1[::1]')
def grouped(span):  # type: ignore[no-untyped-def]
    """
    Put events into groups whose spans are at most 255 together, nearly as few as can be.

    :param span: (E,) uint8, above 0.
    :returns: the order of the events, (E,) int64, and where in it each group ends, (G,) int32.
    """
    ascending = np.argsort(span, kind='mergesort')
    # Those of span s are from first[s] on in this order; those before rest[s] are left.
    count = np.zeros(_MOST + 2, np.int64)
    for each in span:
        count[np.int64(each) + 1] += 1
    first = np.cumsum(count)
    rest = first[1:].copy()
    order, ends = np.empty(len(span), np.int64), np.empty(len(span), np.int32)
    taken = groups = 0
    while taken < len(span):
        # Always the largest for which there is room.
        room = wanted = _MOST
        while wanted > 0:
            if rest[wanted] > first[wanted]:
                rest[wanted] -= 1
                order[taken] = ascending[rest[wanted]]
                taken += 1
                room -= wanted
            else:
                wanted -= 1
            wanted = min(wanted, room)
        ends[groups] = taken
        groups += 1
    return order, ends[:groups]


@kernel('u1[:,::1]')
def minimum_arborescence(pixels):  # type: ignore[no-untyped-def]
    """
    Return a minimum spanning arborescence that starts at the empty template.

    The length of an edge is the number of pixels in which its two templates differ.  Equal
    templates, such as the half-cycle twins of a profile view, are neighbours at length 0.

    :param pixels: (K, N) uint8.
    :returns: order of the templates, parents first, and the parent of each template (by
        template, -1 = the empty one), both (K,) int64.  R. C. Prim, 1957.
    """
    count, size = pixels.shape
    distance = np.empty(count, np.int64)
    parent = np.full(count, -1, np.int64)
    order = np.empty(count, np.int64)
    done = np.zeros(count, np.bool_)
    for k in range(count):
        differ = 0
        for x in range(size):
            differ += pixels[k, x] != 0
        distance[k] = differ
    for place in range(count):
        nearest = -1
        for k in range(count):
            if not done[k] and (nearest < 0 or distance[k] < distance[nearest]):
                nearest = k
        done[nearest] = True
        order[place] = nearest
        for k in range(count):
            if not done[k]:
                differ = 0
                for x in range(size):
                    differ += pixels[k, x] != pixels[nearest, x]
                if differ < distance[k]:
                    distance[k] = differ
                    parent[k] = nearest
    return order, parent


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
    """

    def _code(self, templates: Images) -> NDArray[np.int32]:
        grid = self._grid
        self.program = make_program(templates.reshape(-1, grid.height, grid.width))
        self._origins = _origins(self.program.pixels, grid)
        return self.program.row

    def common_rows(
        self,
        images: Images,
        searched: SearchRange,
        matrix: Images,
        out: NDArray[np.int32],
    ) -> NDArray[np.int32]:
        """Gather the windows block by block, and run the program on each."""
        program, step, shape = self.program, self._grid.step, _plane_shape(self._grid)
        # For each image step x step planes, one after the other: the pixels by their remainders
        # modulo the step, so that windows are contiguous.
        planes = np.zeros((len(images), step * step, *shape), np.uint8)
        for y in range(step):
            for x in range(step):
                part = images[:, y::step, x::step]
                planes[:, y * step + x, : part.shape[1], : part.shape[2]] = part
        plane = planes.reshape(-1)[searched.first[1] * shape[1] + searched.first[2] :]
        changes = program.source, program.lo, program.span, program.groups
        steps = program.bounds, program.target, program.base
        for block, (places, offsets) in enumerate(_runs(self._grid, searched.shape)):
            _gather(_words(plane), self._origins, places, offsets, _words(matrix))
            _run_program(matrix, *changes, *steps, out.reshape(-1), out.shape[1], block * LANES)
        return out[1:]

    def new_matrix(self) -> NDArray[np.uint8]:
        """Return an array for ``matrix`` of :meth:`common_rows`, with a run to spare."""
        size = (len(self.program.pixels) + 1) * LANES
        memory = np.zeros(size + _CACHE_LINE, np.uint8)
        # From a cache line on, so that no row of lanes needs one more.
        first = -memory.ctypes.data % _CACHE_LINE
        return memory[first : first + size]


@lru_cache(maxsize=16)
def _plane_shape(grid: WindowGrid) -> tuple[int, int]:
    """Return rows and columns of a plane, with room to read a run from its last pixel."""
    height, width = grid.image_shape
    return -(-height // grid.step) + 1, -(-width // grid.step) + _WORD


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
            window += min(_WORD, columns - column)
        blocks.append((np.array(places, np.int64), np.array(offsets, np.int64)))
    return blocks


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
            matrix[row + places[run]] = plane[origin + offsets[run]]


@kernel(
    'u1[::1], u2[::1], u1[::1], u1[::1], i4[::1], i4[:,::1], i4[::1], i4[::1], i4[::1], i8, i8'
)
def _run_program(  # type: ignore[no-untyped-def]
    matrix, source, lo, span, groups, bounds, target, base, out, stride, first
):
    """
    Make the common areas of all templates for the gathered windows.

    :param matrix: flat uint8, ``LANES`` bytes for each pixel of the program.
    :param source: as the next six in :class:`EventProgram`.
    :param out: flat int32, rows of ``stride``; row 0 must be zero.
    :param first: where the windows' results begin in a row.
    """
    inner, total = np.empty(LANES, np.uint8), np.empty(LANES, np.int16)
    for step in range(len(target)):
        total[:] = 0
        middle = bounds[step, 1]
        for group in range(bounds[step, 0], bounds[step, 2]):
            # In bytes as long as they can hold the sums: so the vector unit adds twice as many.
            inner[:] = 0
            for event in range(np.int64(groups[group]), np.int64(groups[group + 1])):
                at = np.uint64(source[event]) * np.uint64(LANES)
                values = matrix[at : at + np.uint64(LANES)]
                low, most = lo[event], span[event]
                for lane in range(LANES):
                    value = min(np.uint8(max(values[lane], low) - low), most)
                    inner[lane] = np.uint8(inner[lane] + value)
            sign = np.int16(1 if group < middle else -1)
            for lane in range(LANES):
                total[lane] = np.int16(total[lane] + sign * np.int16(inner[lane]))
        old, new = base[step] * stride + first, target[step] * stride + first
        for lane in range(LANES):
            out[new + lane] = out[old + lane] + np.int32(total[lane])
