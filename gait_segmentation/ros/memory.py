# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How the C library deals with the memory of large images."""

from __future__ import annotations

import ctypes
import sys

__all__ = ['keep_freed_memory', 'take_ahead']

_M_TRIM_THRESHOLD = -1
_M_MMAP_THRESHOLD = -3
_M_ARENA_MAX = -8
# The most that glibc takes.
_MAPPED_FROM = 32 << 20
_KEPT = 256 << 20
_AHEAD = 16 << 20
"""What the stages take for the first image of 1280 x 720 pixels, about."""


def keep_freed_memory() -> bool:
    """
    Let the C library keep freed memory for the next image instead of returning it.

    Else every message of a large image is written to fresh pages, and to have the kernel make
    those takes several times as long as to copy the image.

    :returns: whether the C library can do so; it is glibc that can.
    """
    if sys.platform != 'linux':
        return False
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError):
        return False
    # Threads share what is freed: else each would begin with fresh pages of its own.
    return bool(
        mallopt(_M_MMAP_THRESHOLD, _MAPPED_FROM)
        and mallopt(_M_TRIM_THRESHOLD, _KEPT)
        and mallopt(_M_ARENA_MAX, 1)
    )


def take_ahead() -> None:
    """
    Have the kernel make the pages that the first image will need, before it comes.

    They are written to and freed; where :func:`keep_freed_memory` has been called they stay.
    """
    bytearray(b'\1') * _AHEAD
