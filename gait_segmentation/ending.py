# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Ending a process in order, whatever signals come, and whenever."""

from __future__ import annotations

import faulthandler
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

from gait_segmentation.commands import ENDING

__all__ = ['HANGS_S', 'LONGEST_S', 'Ending']

_STDERR = 2
LONGEST_S = 4.0
"""Time that a process has to close everything, once it is to end."""

_PATIENCE_S = 1.0
"""Time that closing may take from within a handler."""

HANGS_S = 20.0
"""Time without a beat after which a process ends."""


class Ending:
    """
    Handles the signals that end a process.

    The first one is noticed by the next :meth:`turn`.  A second one, or the first while
    :attr:`at_once`, closes everything and ends the process from within the handler.  An exception
    would not do: it is lost wherever Python cannot hand it on, as in a compiler's callbacks and in
    destructors.
    """

    def __init__(self, shut_down: Callable[[], object], *, at_once: bool = False) -> None:
        """
        Begin with nothing to close.

        :param shut_down: ends what the process does, such as the spinning of an executor.
        """
        self._shut_down = shut_down
        self.asked = False
        """Whether a signal has come."""

        self.at_once = at_once
        """Whether the first signal ends the process."""

        self._closing: list[Callable[[], object]] = []
        self._over = False

    def handle_signals(self) -> None:
        """Handle them from now on; to be called in the main thread."""
        for number in ENDING:
            # What nohup has begun is to survive its terminal.
            if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN:
                signal.signal(number, self)

    def turn(self) -> None:
        """Go on, unless a signal has come: then what the process does is to end."""
        self.beat()
        if self.asked:
            self._shut_down()

    def beat(self) -> None:
        """
        Have the stacks printed and the process ended unless there is another beat in time.

        The thread that does so needs no lock of the interpreter's, with which a call into the DDS
        may block for ever.
        """
        if not self.asked:
            faulthandler.dump_traceback_later(HANGS_S, exit=True, file=_STDERR)

    @contextmanager
    def unhurried(self) -> Iterator[None]:
        """Let what is done take as long as it takes, unless a signal breaks it off."""
        faulthandler.cancel_dump_traceback_later()
        before, self.at_once = self.at_once, True
        if self.asked:
            self(signal.SIGINT, None)
        try:
            yield
        finally:
            self.at_once = before
            self.beat()

    def closes(self, close: Callable[[], object]) -> None:
        """Have something called at the end, in the order of these calls."""
        self._closing.append(close)

    def close(self) -> None:
        """Close everything, and shut down at last, whatever signals come meanwhile."""
        # Nothing that could be interrupted comes before this.
        self._over = True
        faulthandler.dump_traceback_later(LONGEST_S, exit=True, file=_STDERR)
        for number in ENDING:
            signal.signal(number, signal.SIG_IGN)
        while self._closing:
            self._closing.pop(0)()
        self._shut_down()
        faulthandler.cancel_dump_traceback_later()

    def __call__(self, number: int, frame: object) -> None:
        """Handle a signal, as :func:`signal.signal` asks for it."""
        if self._over:
            return
        if self.at_once or self.asked:
            # What was interrupted may hold a lock that the closing waits for.
            patience = threading.Timer(_PATIENCE_S, os._exit, (0,))
            patience.daemon = True
            patience.start()
            with suppress(Exception):
                self.close()
            for stream in (sys.stdout, sys.stderr):
                with suppress(Exception):
                    stream.flush()
            # Without the interpreter's clean-up, in the middle of whatever was interrupted.
            os._exit(0)
        self.asked = True
        # What it has interrupted may never return, or hold a lock that the closing waits for.
        faulthandler.dump_traceback_later(LONGEST_S, exit=True, file=_STDERR)
