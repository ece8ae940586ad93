# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Ending a process of ROS 2 in order, whatever signals come, and whenever."""

from __future__ import annotations

import faulthandler
import os
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from typing import NoReturn

import rclpy
from rclpy.signals import uninstall_signal_handlers

__all__ = ['HANGS_S', 'LONGEST_S', 'Ending', 'leave']

_SIGNALS = (signal.SIGINT, signal.SIGTERM)
_STDERR = 2
LONGEST_S = 4.0
"""Time that a process has to close everything, once it is to end."""

HANGS_S = 20.0
"""Time without a beat after which a process ends."""


class Ending:
    """
    Handles the signals that end a process.

    The first one lets what runs go on: rclpy's own handler closes the context, which ends the
    spinning in order.  A second one, or the first while :attr:`at_once`, closes everything and
    ends the process from within the handler.  An exception would not do: it is lost wherever
    Python cannot hand it on, as in a compiler's callbacks and in destructors.
    """

    def __init__(self, *, at_once: bool = False) -> None:
        """Begin with nothing to close."""
        self.asked = False
        """Whether a signal has come."""

        self.at_once = at_once
        """Whether the first signal ends the process."""

        self._closing: list[Callable[[], object]] = []
        self._over = False

    def handle_signals(self) -> None:
        """Handle them from now on; to be called in the main thread, before ``rclpy.init``."""
        for number in _SIGNALS:
            signal.signal(number, self)

    def beat(self) -> None:
        """
        Have the stacks printed and the process ended unless there is another beat in time.

        The thread that does so needs no lock of the interpreter's, with which a call into the DDS
        may block for ever.
        """
        if not self.asked:
            faulthandler.dump_traceback_later(HANGS_S, exit=True, file=_STDERR)

    def closes(self, close: Callable[[], object]) -> None:
        """Have something called at the end, in the order of these calls."""
        self._closing.append(close)

    def close(self) -> None:
        """Close everything, the context last, whatever signals come meanwhile."""
        # Nothing that could be interrupted comes before this.
        self._over = True
        faulthandler.dump_traceback_later(LONGEST_S, exit=True, file=_STDERR)
        # rclpy handles signals in a thread that uses the guard conditions of executors, so that
        # thread must have ended before they are destroyed.
        uninstall_signal_handlers()
        for number in _SIGNALS:
            signal.signal(number, signal.SIG_IGN)
        while self._closing:
            self._closing.pop(0)()
        rclpy.try_shutdown()
        faulthandler.cancel_dump_traceback_later()

    def __call__(self, number: int, frame: object) -> None:
        """Handle a signal, as :func:`signal.signal` asks for it."""
        if self._over:
            return
        if self.at_once or self.asked:
            self._over = True
            self._end_at_once()
        self.asked = True
        # What it has interrupted may never return, or hold a lock that the closing waits for.
        faulthandler.dump_traceback_later(LONGEST_S, exit=True, file=_STDERR)

    def _end_at_once(self) -> None:
        with suppress(Exception):
            self.close()
        leave(0)


def leave(code: int) -> NoReturn:
    """End the process without the interpreter's clean-up."""
    for stream in (sys.stdout, sys.stderr):
        with suppress(Exception):
            stream.flush()
    os._exit(code)
