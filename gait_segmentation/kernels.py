# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Compiled functions, and compiling them before the first frame comes.

Numba compiles a kernel, or loads it from its cache, when it is first called with arguments of new
types; that takes up to seconds and must not happen while a camera waits.  So each kernel that is
called from Python declares these types where it is defined, and a node compiles what is declared
by the modules of its stage.  What only other kernels call is compiled into them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numba import njit
from numba.core.dispatcher import Dispatcher
from numba.core.sigutils import normalize_signature

from gait_segmentation.kernel_cache import mend_kernel_cache

__all__ = ['Kernels', 'compile_kernels', 'kernel']

_PACKAGE = __name__.partition('.')[0]


@dataclass(frozen=True, eq=False)
class _Declared:
    """A kernel and the types of its arguments when it is called in one way."""

    function: Dispatcher
    types: str


_declared: list[_Declared] = []
_asked_for: list[_Declared] = []
_ready: list[_Declared] = []


def kernel(*calls: str, **options: Any) -> Callable[[Callable[..., Any]], Any]:
    """
    Have Numba compile a function, without the interpreter's lock, and keep the result.

    :param calls: types of all arguments, as Numba writes them (``'uint8[:,::1], float64'``): one
        string for each way in which the stages call the kernel from Python, none if only other
        kernels do.
    :param options: of ``numba.njit``, such as ``fastmath``.
    """

    def made(function: Callable[..., Any]) -> Any:
        # Nobody calls kernels from C, and without what that needs they are compiled sooner.
        compiled = njit(cache=True, nogil=True, no_cfunc_wrapper=True, **options)(function)
        _declared.extend(_Declared(compiled, types) for types in calls)
        return compiled

    return made


def compile_kernels(
    *packages: str, shown: Callable[[list[_Declared]], Iterable[_Declared]] = iter
) -> None:
    """
    Compile all declared kernels of the modules that are imported, or load them from the cache.

    :param packages: names of packages and modules, such as ``gait_segmentation.matching``; those
        of all if there is none.
    :param shown: passes the kernels on, one by one, and may show how far they are.
    :raises ConfigError: if a damaged file of the cache cannot be removed.
    """
    mend_kernel_cache()
    # OpenCV makes tables the first time, which takes as long as some frames.
    cv2.cvtColor(np.zeros((1, 1, 3), np.uint8), cv2.COLOR_BGR2Lab)
    roots = tuple(f'{package}.' for package in packages or (_PACKAGE,))
    wanted = [
        each
        for each in _declared
        if f'{each.function.py_func.__module__}.'.startswith(roots) and each not in _ready
    ]
    _asked_for.extend(each for each in wanted if each not in _asked_for)
    for each in shown(wanted):
        each.function.compile(normalize_signature(f'({each.types},)')[0])
        _ready.append(each)


@dataclass(frozen=True)
class Kernels:
    """How far the kernels are that are to be compiled, as they are at a time."""

    ready: int
    """Those that can be called without delay."""

    known: int
    """All."""

    compiled: int
    """How often the cache had nothing."""

    @classmethod
    def now(cls) -> Kernels:
        """Count; may be called while another thread compiles."""
        return cls(
            ready=len(_ready),
            known=len(_asked_for),
            compiled=sum(
                sum(function.stats.cache_misses.values())
                for function in {each.function for each in _declared}
            ),
        )
