# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How many kernels are compiled, or loaded from Numba's cache."""

from __future__ import annotations

import sys
from dataclasses import dataclass

from numba.core.dispatcher import Dispatcher

__all__ = ['Kernels']

_PACKAGE = __name__.partition('.')[0]


@dataclass(frozen=True)
class Kernels:
    """The kernels of the modules that are imported, as they are at a time."""

    ready: int
    """Those that can be called without delay."""

    known: int
    """All; what others call is not among the ready ones when those come from the cache."""

    compiled: int
    """How often the cache had nothing."""

    @classmethod
    def now(cls) -> Kernels:
        """Count; may be called while another thread imports and compiles."""
        found = [
            each
            for name, module in list(sys.modules.items())
            if name.startswith(f'{_PACKAGE}.')
            for each in list(vars(module).values())
            if isinstance(each, Dispatcher) and each.py_func.__module__ == name
        ]
        return cls(
            ready=sum(bool(each.signatures) for each in found),
            known=len(found),
            compiled=sum(sum(each.stats.cache_misses.values()) for each in found),
        )
