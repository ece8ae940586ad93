# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Saying why a start takes long."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from gait_segmentation.files.output_files import named

__all__ = ['compiling']

_PATIENCE_S = 5.0


@contextmanager
def compiling(say: Callable[[str], None], patience_s: float = _PATIENCE_S) -> Iterator[None]:
    """
    Say that kernels are loaded or compiled if what is done takes long.

    Errors of files have the name of the cache of kernels.

    :param say: called once at most, in another thread.
    """
    slow = threading.Timer(
        patience_s,
        say,
        ['loading kernels, or compiling them: a minute or two, once after each installation'],
    )
    slow.daemon = True
    slow.start()
    try:
        # Which is all that is written here.
        with named('the cache of compiled kernels'):
            yield
    finally:
        slow.cancel()
