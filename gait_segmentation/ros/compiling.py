# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Compiling beside the executor, and saying why a start takes long."""

from __future__ import annotations

import threading
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager

from gait_segmentation.files.output_files import named

__all__ = ['Aside', 'compiling']

_PATIENCE_S = 5.0
_TURN_S = 0.05


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


class Aside:
    """
    Something done in a thread of its own, which a coroutine of an executor can wait for.

    rclpy takes up a coroutine that waits whenever the executor wakes.  So each time this waits a
    moment for the thread, which costs nothing, and then gives way to the other callbacks.
    """

    def __init__(self, work: Callable[[], None], wake: Callable[[], None]) -> None:
        """
        Begin.

        :param wake: wakes the executor when the work has ended; called in the other thread.
        """
        self._work = work
        self._wake = wake
        self._error: BaseException | None = None
        self._done = False
        self._thread = threading.Thread(target=self._run, name='compiler', daemon=True)
        self._thread.start()

    @property
    def done(self) -> bool:
        """Return whether it has ended."""
        return self._done

    def __await__(self) -> Generator[None, None, None]:
        """Wait until it has ended; others have their turn once at least."""
        while True:
            self._thread.join(_TURN_S)
            yield
            if self.done:
                return

    def check(self) -> None:
        """Raise what it has raised, if anything."""
        if self._error is not None:
            raise self._error

    def _run(self) -> None:
        try:
            self._work()
        except Exception as error:  # Handed on to whoever waits.
            self._error = error
        finally:
            self._done = True
            self._wake()
