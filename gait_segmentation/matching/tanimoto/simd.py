# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Inner loops of the event kernel on vectors that stay in registers.

Numba's own loops keep the partial sums in memory and widen every pixel to 32 bits; written with
LLVM's vector types the same sums stay in 8 and 16 bits inside registers.  LLVM turns the types
into what the processor has, so nothing here is bound to one kind of processor.
"""

from __future__ import annotations

import functools
from typing import Any

import numba.core.cgutils as cgutils
import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]
from numba import types
from numba.extending import intrinsic

from gait_segmentation.kernels import kernel
from gait_segmentation.matching.tanimoto.program import PAIR

__all__ = ['LANES', 'RUN', 'gather', 'run_program']

LANES = 192
"""Windows that one call of :func:`run_program` treats."""

RUN = 16
"""Bytes that are copied at once."""

_WIDTH = 64
"""Bytes of a vector; where registers are shorter LLVM takes several for one."""

_PARTS = LANES // _WIDTH
_I8, _I16, _I32, _I64 = (ir.IntType(bits) for bits in (8, 16, 32, 64))
_V8, _V32 = (ir.VectorType(kind, _WIDTH) for kind in (_I8, _I32))
_V16 = ir.VectorType(_I16, _WIDTH // 2)


def _address(context: Any, builder: Any, kind: Any, array: Any, index: Any) -> Any:
    data = context.make_array(kind)(context, builder, array).data
    return builder.gep(data, [index])


def _vector_at(builder: Any, pointer: Any, offset: int, kind: Any, align: int) -> Any:
    place = builder.gep(pointer, [ir.Constant(_I64, offset)])
    place = builder.bitcast(place, kind.as_pointer())
    return place, builder.load(place, align=align)


def _splat(builder: Any, value: Any) -> Any:
    nothing = ir.Constant(_V8, ir.Undefined)
    single = builder.insert_element(nothing, value, ir.Constant(_I32, 0))
    return builder.shuffle_vector(single, nothing, ir.Constant(_V32, [0] * _WIDTH))


@intrinsic
def _copy_run(typing: Any, target: Any, where: Any, source: Any, origin: Any) -> Any:
    """Copy ``RUN`` bytes from ``source[origin]`` on to ``target[where]`` on, both flat uint8."""
    signature = types.void(target, where, source, origin)

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        kind = ir.VectorType(_I8, RUN).as_pointer()
        write = _address(context, builder, signature.args[0], args[0], args[1])
        read = _address(context, builder, signature.args[2], args[2], args[3])
        run = builder.load(builder.bitcast(read, kind), align=1)
        builder.store(run, builder.bitcast(write, kind), align=1)
        return context.get_dummy_value()

    return signature, generate


@intrinsic
def _apply_step(
    typing: Any,
    matrix: Any,
    source: Any,
    lo: Any,
    span: Any,
    bounds: Any,
    step: Any,
    base: Any,
    base_at: Any,
    target: Any,
    target_at: Any,
) -> Any:
    """
    Add the events of one step of a program to ``LANES`` common areas.

    ``matrix`` is flat uint8, ``LANES`` bytes a pixel; ``source``, ``lo``, ``span`` and ``bounds``
    as in :class:`EventProgram`; reads int32 from the flat ``base[base_at]`` on and writes to the
    flat ``target[target_at]`` on.  Indices are int64.
    """
    signature = types.void(
        matrix, source, lo, span, bounds, step, base, base_at, target, target_at
    )

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        def at(argument: int, index: Any) -> Any:
            return _address(context, builder, signature.args[argument], args[argument], index)

        def constant(value: int) -> Any:
            return ir.Constant(_I64, value)

        eight = ir.Constant(_V16, [8] * (_WIDTH // 2))
        in_turn = ir.Constant(_V32, [k // 2 + k % 2 * (_WIDTH // 2) for k in range(_WIDTH)])
        binary = ir.FunctionType(_V8, [_V8, _V8])
        module = builder.module
        minus = cgutils.get_or_insert_function(module, binary, f'llvm.usub.sat.v{_WIDTH}i8')
        least = cgutils.get_or_insert_function(module, binary, f'llvm.umin.v{_WIDTH}i8')
        sums = [
            (cgutils.alloca_once(builder, _V16), cgutils.alloca_once(builder, _V16))
            for _ in range(_PARTS)
        ]
        for total, upper in sums:
            builder.store(ir.Constant(_V16, None), total)
            builder.store(ir.Constant(_V16, None), upper)

        def changes(event: Any) -> list[Any]:
            pixel = builder.zext(builder.load(at(1, event)), _I64)
            floor = _splat(builder, builder.load(at(2, event)))
            most = _splat(builder, builder.load(at(3, event)))
            row = at(0, builder.mul(pixel, constant(LANES)))
            result = []
            for part in range(_PARTS):
                _, value = _vector_at(builder, row, part * _WIDTH, _V8, 1)
                result.append(builder.call(least, [builder.call(minus, [value, floor]), most]))
            return result

        signs = ['++++', '++', '----', '--', '+-']  # of the members, as in EventProgram
        for kind, sign in enumerate(signs):
            narrow = kind in (0, 2)
            edge = builder.mul(args[5], constant(len(signs) + 1))
            first, last = (
                builder.sext(builder.load(at(4, builder.add(edge, constant(k)))), _I64)
                for k in (kind, kind + 1)
            )
            with cgutils.for_range_slice(
                builder, first, last, constant(len(sign) // PAIR), intp=_I64
            ) as (pair, _):
                event = builder.mul(pair, constant(PAIR))
                members = [changes(builder.add(event, constant(k))) for k in range(len(sign))]
                if narrow:
                    members = [
                        [
                            functools.reduce(builder.add, part)
                            for part in zip(*members, strict=True)
                        ]
                    ]
                for plus, member in zip(sign, members, strict=False):
                    combine = builder.add if plus == '+' else builder.sub
                    for (total, upper), part in zip(sums, member, strict=True):
                        pairs = builder.bitcast(part, _V16)
                        high = builder.lshr(pairs, eight)
                        builder.store(combine(builder.load(total), pairs), total)
                        builder.store(combine(builder.load(upper), high), upper)

        read, write = at(6, args[7]), at(8, args[9])
        for part, (total, upper) in enumerate(sums):
            high = builder.load(upper)
            low = builder.sub(builder.load(total), builder.shl(high, eight))
            both = builder.shuffle_vector(low, high, in_turn)
            _, old = _vector_at(builder, read, part * _WIDTH, _V32, 4)
            goal = builder.gep(write, [constant(part * _WIDTH)])
            new = builder.add(old, builder.sext(both, _V32))
            builder.store(new, builder.bitcast(goal, _V32.as_pointer()), align=4)
        return context.get_dummy_value()

    return signature, generate


@kernel('u1[::1], i8[::1], i8[::1], i8[::1], u1[::1]')
def gather(plane, origins, places, offsets, matrix):  # type: ignore[no-untyped-def]
    """
    Put the windows of a block side by side for all pixels, run by run.

    :param plane: flat uint8 image, its pixels ordered so that windows are contiguous.
    :param origins: (A,) int64, where in it the pixels of the first window are.
    :param places: (R,) int64 lanes at which the runs begin.
    :param offsets: (R,) int64, how far the runs' windows are from the first one.
    :param matrix: flat uint8, result, ``LANES`` bytes a pixel and a run to spare.
    """
    for pixel in range(len(origins)):
        origin = origins[pixel]
        row = pixel * LANES
        for run in range(len(places)):
            _copy_run(matrix, row + places[run], plane, origin + offsets[run])


@kernel('u1[::1], u2[::1], u1[::1], u1[::1], i4[::1], i4[::1], i4[::1], i4[::1], i8, i8')
def run_program(  # type: ignore[no-untyped-def]
    matrix, source, lo, span, bounds, target, base, out, stride, first
):
    """
    Make the common areas of all templates for the gathered windows.

    :param matrix: flat uint8, ``LANES`` bytes for each pixel of the program.
    :param source: as the next five in :class:`EventProgram`, ``bounds`` flat.
    :param out: flat int32, rows of ``stride``; row 0 must be zero.
    :param first: where the windows' results begin in a row.
    """
    for step in range(len(target)):
        _apply_step(
            matrix,
            source,
            lo,
            span,
            bounds,
            np.int64(step),
            out,
            np.int64(base[step] * stride + first),
            out,
            np.int64(target[step] * stride + first),
        )
