# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The default kernel: templates as changes against their parents, added up by the vector unit."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numpy.typing import NDArray

from gait_segmentation.kernels import kernel
from gait_segmentation.matching.common_areas import CommonAreas, Images
from gait_segmentation.matching.placements import LANES, SearchRange, WindowGrid

_WORD = 16  # bytes that are copied at once
_CACHE_LINE = 64
# Lanes in a vector of bytes; the compiler makes several of it where registers are shorter.
_VECTOR = 64
# Lanes that are treated at a time while there are so many: what the registers hold.
_WIDE = 2 * LANES
_MOST_CHANGE = 255  # what the events of a group change a sum by at most, which 8 bits can hold
_MOST_OF_STEP = 32767 // _MOST_CHANGE  # groups that a step has at most: what 16 bits can add up


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
    """Code (K, height, width) uint8 templates as changes against their parents."""
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
    count = np.zeros(_MOST_CHANGE + 2, np.int64)
    for each in span:
        count[np.int64(each) + 1] += 1
    first = np.cumsum(count)
    rest = first[1:].copy()
    order, ends = np.empty(len(span), np.int64), np.empty(len(span), np.int32)
    taken = groups = 0
    while taken < len(span):
        # Always the largest for which there is room.
        room = wanted = _MOST_CHANGE
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
    several images, side by side, so that one event is a handful of vector additions for 320 of
    them.

    The number of events of binary templates sampled from a closed motion tends to a constant, the
    number of times the pixels flip during the motion, however finely the motion is sampled.
    """

    def _code(self, templates: Images) -> NDArray[np.int32]:
        grid = self._grid
        self.program = make_program(templates.reshape(-1, grid.height, grid.width))
        rows, columns = _plane_shape(grid)
        y, x = np.divmod(self.program.pixels, grid.width)
        phase = (y % grid.step) * grid.step + x % grid.step
        # Where in the planes the pixels of the first window are.
        self._origins = (phase * rows + y // grid.step) * columns + x // grid.step
        return self.program.row

    def common_rows(
        self, images: Images, searched: SearchRange, matrix: Images, out: NDArray[np.int32]
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
        for start, lanes, places, offsets in _blocks(self._grid, searched.shape):
            _gather(_words(plane), self._origins, places, offsets, lanes, _words(matrix))
            rows = out.reshape(-1), out.shape[1], start
            _run_program(matrix, *changes, *steps, *rows, lanes)
        return out[1:]

    def new_matrix(self) -> NDArray[np.uint8]:
        """Return an array for ``matrix`` of :meth:`common_rows`, with a run to spare."""
        size = len(self.program.pixels) * _WIDE + _WORD
        memory = np.zeros(size + _CACHE_LINE, np.uint8)
        # From a cache line on, so that no row of lanes needs one more.
        first = -memory.ctypes.data % _CACHE_LINE
        return memory[first : first + size]


@lru_cache(maxsize=16)
def _plane_shape(grid: WindowGrid) -> tuple[int, int]:
    """Return rows and columns of a plane, with room to read a run from its last pixel."""
    height, width = grid.image_shape
    return -(-height // grid.step) + 1, -(-width // grid.step) + _WORD


@lru_cache(maxsize=16)
def _blocks(
    grid: WindowGrid, windows: tuple[int, int, int]
) -> list[tuple[int, int, NDArray[np.int64], NDArray[np.int64]]]:
    """Return first window and lanes of blocks, and lane and offset in the planes of their runs."""
    planes, (height, width) = grid.step**2, _plane_shape(grid)
    images, rows, columns = windows
    count = images * rows * columns
    blocks = []
    for start in range(0, count, _WIDE):
        last = min(start + _WIDE, count)
        lanes = LANES if last - start <= LANES else _WIDE
        places, offsets, window = [], [], start
        while window < last:
            line, column = divmod(window, columns)
            image, row = divmod(line, rows)
            places.append(window - start)
            offsets.append((image * planes * height + row) * width + column)
            window += min(_WORD, columns - column)
        runs = np.array(places, np.int64), np.array(offsets, np.int64)
        blocks.append((start, lanes, *runs))
    return blocks


def _words(data: NDArray[np.uint8]) -> NDArray[np.complex128]:
    """Return the words that begin at each byte, which share their memory."""
    return np.ndarray((data.size - _WORD + 1,), np.complex128, data.data, strides=(1,))


@kernel('c16[:], i8[::1], i8[::1], i8[::1], i8, c16[:]')
def _gather(plane, origins, places, offsets, lanes, matrix):  # type: ignore[no-untyped-def]
    """Put the windows of a block side by side for all pixels, run by run, as words."""
    for pixel in range(len(origins)):
        origin, row = origins[pixel], pixel * lanes
        for run in range(len(places)):
            matrix[row + places[run]] = plane[origin + offsets[run]]


def _make_step(lanes: int):  # type: ignore[no-untyped-def]
    """Return a function that makes the areas of a template from those of its parent."""
    # For LLVM, in vectors of bytes: in a loop over lanes the compiler would keep sums in memory,
    # and make the vectors as short as its widest type asks for.

    def generate(context, builder, signature, values):  # type: ignore[no-untyped-def]
        index, byte, word, whole = (ir.IntType(bits) for bits in (64, 8, 16, 32))
        first, middle, last, _, old, new = values[5:]
        matrix, source, lo, span, groups, out = (
            context.make_array(kind)(context, builder, value).data
            for kind, value in zip(signature.args, values, strict=True)
            if isinstance(kind, types.Array)
        )

        def at(array, place):  # type: ignore[no-untyped-def]
            return builder.load(builder.gep(array, [place]))

        def vector(array, place, lane, kind):  # type: ignore[no-untyped-def]
            start = builder.gep(array, [builder.add(place, index(lane))])
            return builder.bitcast(start, kind.as_pointer())

        def everywhere(value, size):  # type: ignore[no-untyped-def]
            one = builder.insert_element(ir.VectorType(byte, size)(ir.Undefined), value, index(0))
            return builder.shuffle_vector(one, one, ir.VectorType(whole, size)(None))

        def joined(name, one, other):  # type: ignore[no-untyped-def]
            kind = ir.FunctionType(one.type, (one.type, one.type))
            name = f'llvm.{name}.v{one.type.count}i8'
            return builder.call(
                cgutils.get_or_insert_function(builder.module, kind, name), (one, other)
            )

        # Of two neighbouring bytes as a number of 16 bits: sums of these numbers, and of the
        # upper bytes.  What the lower ones are together follows, so that none is put apart.
        parts = []
        for lane in range(0, lanes, _VECTOR):
            size = min(_VECTOR, lanes - lane)
            kinds = ir.VectorType(byte, size), *[ir.VectorType(word, size // 2)] * 2
            sums = [cgutils.alloca_once_value(builder, kind(None)) for kind in kinds]
            for kind, total in zip(kinds, sums, strict=True):
                builder.store(kind(None), total)
            parts.append((lane, size, kinds[0], sums))

        def add(event, begins):  # type: ignore[no-untyped-def]
            row = builder.mul(builder.zext(at(source, event), index), index(lanes))
            low, most = at(lo, event), at(span, event)
            for lane, size, narrow, (inner, _, _) in parts:
                value = builder.load(vector(matrix, row, lane, narrow), align=1)
                value = joined('usub.sat', value, everywhere(low, size))
                value = joined('umin', value, everywhere(most, size))
                if not begins:
                    value = builder.add(builder.load(inner), value)
                builder.store(value, inner)

        for start, end, join in ((first, middle, builder.add), (middle, last, builder.sub)):
            with cgutils.for_range(builder, end, start, index) as group:
                begin = builder.zext(at(groups, group.index), index)
                stop = builder.zext(at(groups, builder.add(group.index, index(1))), index)
                add(begin, True)
                second = builder.add(begin, index(1))
                with cgutils.for_range(builder, stop, second, index) as event:
                    add(event.index, False)
                for _, _, _, (inner, pairs, upper) in parts:
                    both = builder.bitcast(builder.load(inner), builder.load(pairs).type)
                    builder.store(join(builder.load(pairs), both), pairs)
                    above = builder.lshr(both, both.type([8] * both.type.count))
                    builder.store(join(builder.load(upper), above), upper)
        for lane, size, _, (_, pairs, upper) in parts:
            above = builder.load(upper)
            shifted = builder.shl(above, above.type([8] * above.type.count))
            below = builder.sub(builder.load(pairs), shifted)
            order = [each // 2 + each % 2 * (size // 2) for each in range(size)]
            total = builder.shuffle_vector(below, above, ir.VectorType(whole, size)(order))
            kind = ir.VectorType(whole, size)
            value = builder.load(vector(out, old, lane, kind), align=4)
            value = builder.add(value, builder.sext(total, kind))
            builder.store(value, vector(out, new, lane, kind), align=4)
        return context.get_dummy_value()

    @intrinsic
    def step(  # type: ignore[no-untyped-def]
        typing, matrix, source, lo, span, groups, first, middle, last, out, old, new
    ):
        given = matrix, source, lo, span, groups, first, middle, last, out, old, new
        return types.void(*given), generate

    return step


_narrow_step, _wide_step = _make_step(LANES), _make_step(_WIDE)


@kernel(
    'u1[::1], u2[::1], u1[::1], u1[::1], i4[::1], i4[:,::1], i4[::1], i4[::1], i4[::1], i8, i8, i8'
)
def _run_program(  # type: ignore[no-untyped-def]
    matrix, source, lo, span, groups, bounds, target, base, out, stride, first, lanes
):
    """Make the areas of all templates for gathered windows in rows of ``stride``, row 0 zero."""
    for step in range(len(target)):
        start, middle = np.int64(bounds[step, 0]), np.int64(bounds[step, 1])
        end = np.int64(bounds[step, 2])
        old, new = base[step] * stride + first, target[step] * stride + first
        if lanes == LANES:
            _narrow_step(matrix, source, lo, span, groups, start, middle, end, out, old, new)
        else:
            _wide_step(matrix, source, lo, span, groups, start, middle, end, out, old, new)
