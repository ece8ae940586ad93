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

import functools
import logging
import os
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import cv2
import numpy as np
from numba import njit
from numba.core.dispatcher import Dispatcher
from numba.core.sigutils import normalize_signature

from gait_segmentation.files import named

_PACKAGE = __name__.partition('.')[0]

if not os.path.isabs(os.path.expanduser('~')):
    # The user nobody has no home, and Numba would make a folder of that name.
    os.environ.setdefault('XDG_CACHE_HOME', os.devnull)


# Kernels, and the types of their arguments when they are called in one way.
_declared: list[tuple[Dispatcher, str]] = []
_ready: list[tuple[Dispatcher, str]] = []
_progress = ['']

_EVERY_S = 20.0
"""Time after which it is said again how far the kernels are."""


def kernel(*calls: str, **options: Any) -> Callable[[Callable[..., Any]], Any]:
    """
    Have Numba compile a function, without the interpreter's lock, and keep the result.

    :param calls: types of all arguments, as Numba writes them (``'uint8[:,::1], float64'``): one
        string for each way in which the stages call the kernel from Python, none if only other
        kernels do.
    :param options: of ``numba.njit``, such as ``fastmath``.
    """

    def made(function: Callable[..., Any]) -> Any:
        # Kernels are not called from C, and without what that needs they are compiled sooner.
        compiled = njit(nogil=True, no_cfunc_wrapper=True, **options)(function)
        try:
            compiled.enable_caching()
        except RuntimeError:
            _warn_uncached()
        _declared.extend((compiled, types) for types in calls)
        return compiled

    return made


@functools.cache
def _warn_uncached() -> None:
    logging.getLogger(_PACKAGE).warning(
        'kernels are compiled at each start, for no folder can be written to keep them in: set '
        'NUMBA_CACHE_DIR to one'
    )


def compile_kernels(*packages: str) -> int:
    """
    Compile all declared kernels of the modules that are imported, or load them from the cache.

    :param packages: names of packages and modules, such as ``gait_segmentation.matching``; those
        of all if there is none.
    :returns: how many the cache did not have.
    """
    # OpenCV makes tables the first time, which takes as long as some frames.
    cv2.cvtColor(np.zeros((1, 1, 3), np.uint8), cv2.COLOR_BGR2Lab)
    roots = tuple(f'{package}.' for package in packages or (_PACKAGE,))
    wanted = [
        each
        for each in _declared
        if f'{each[0].py_func.__module__}.'.startswith(roots) and each not in _ready
    ]
    before = _compiled()
    for number, each in enumerate(wanted, 1):
        function, types = each
        _progress[:] = [f'{number} of {len(wanted)}, {function.py_func.__name__}']
        function.compile(normalize_signature(f'({types},)')[0])
        _ready.append(each)
    return _compiled() - before


def _compiled() -> int:
    functions = {function for function, _ in _declared}
    return sum(sum(function.stats.cache_misses.values()) for function in functions)


@contextmanager
def compiling(say: Callable[[str], object], patience_s: float = 5.0) -> Iterator[None]:
    """
    Say that kernels are loaded or compiled if what is done takes long, and how far they are.

    Errors of files have the name of the cache of kernels.

    :param say: called in another thread.
    """
    ended = threading.Event()

    def tell() -> None:
        if not ended.wait(patience_s):
            say('compiling kernels, or loading them: a minute or some, once after an installation')
        while not ended.wait(_EVERY_S):
            say(f'still at the kernels: {_progress[0]}')

    threading.Thread(target=tell, name='compiling', daemon=True).start()
    try:
        # Which is all that is written here.
        with named('the cache of compiled kernels'):
            yield
    finally:
        ended.set()
