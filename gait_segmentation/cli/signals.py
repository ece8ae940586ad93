# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Signals handled otherwise for a while."""

from __future__ import annotations

import contextlib
import signal
from collections.abc import Callable, Iterator
from types import FrameType

__all__ = ['ENDING', 'handled']

ENDING = (signal.SIGINT, signal.SIGTERM)
"""The signals that ask a process to end."""


@contextlib.contextmanager
def handled(
    handler: Callable[[int, FrameType | None], object], *numbers: signal.Signals
) -> Iterator[None]:
    """
    Have signals handled within the context, which must be in the main thread, and as before after.

    :param handler: called with the number of the signal and the frame it interrupted.
    """
    before = {number: signal.signal(number, handler) for number in numbers}
    try:
        yield
    finally:
        for number, old in before.items():
            signal.signal(number, old)
