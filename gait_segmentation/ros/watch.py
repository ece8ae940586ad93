# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Ending a process that hangs, whatever it hangs in.

A call somewhere below rclpy may never return, even with the interpreter's lock held; then no
handler of a signal and no other thread of Python runs any more.  So what watches is a thread that
Python knows nothing of: compiled, and in need of nothing but the system.
"""

from __future__ import annotations

import atexit
import ctypes
import faulthandler
import os
import select
import signal
from typing import Any

import numpy as np
from numba import carray, cfunc, types

from gait_segmentation.ros.ending import HANGS_S, LONGEST_S

__all__ = ['HUNG', 'UNCLOSED', 'Watch']

HUNG, UNCLOSED = 70, 71
"""Exit codes: of a process that did not turn any more, and of one that a signal did not end."""

_TICK_MS = 100
_STDERR = 2

# What both threads know, as 64-bit numbers; times are in ticks.  At the end a struct pollfd, the
# bytes that come from it, and addresses and lengths of three texts.
_BEATS, _ASKED, _OVER, _LONGEST, _SAY, _STILL, _POLLED, _BYTES, _TEXTS = range(9)
_SIZE = _TEXTS + 2 * 3

_int = types.int32
_poll = types.ExternalFunction('poll', _int(types.uintp, types.uint64, _int))
_read = types.ExternalFunction('read', types.intp(_int, types.uintp, types.uintp))
_write = types.ExternalFunction('write', types.intp(_int, types.uintp, types.uintp))
_getpid = types.ExternalFunction('getpid', _int())
_kill = types.ExternalFunction('kill', _int(_int, _int))
_exit = types.ExternalFunction('_exit', types.void(_int))

_INT, _TERM, _STACKS = int(signal.SIGINT), int(signal.SIGTERM), int(signal.SIGUSR1)


def _watch(pointer: Any) -> int:
    """Watch until it is over: compiled, and run in a thread of its own."""
    state = carray(pointer, (_SIZE,))
    begin = types.uintp(state.ctypes.data)
    heard = _int(state[_POLLED] & 0xFFFFFFFF)
    beats, still, waited = state[_BEATS], 0, 0
    while not state[_OVER]:
        state[_POLLED] &= 0xFFFFFFFFFFFF
        if _poll(begin + 8 * _POLLED, 1, _TICK_MS) > 0:
            # Signals by their numbers, as Python's own handler writes them.
            count = _read(heard, begin + 8 * _BYTES, 8)
            for place in range(count):
                number = (state[_BYTES] >> (8 * place)) & 0xFF
                if number in (_INT, _TERM):
                    state[_ASKED] = 1
            continue
        waited += state[_ASKED]
        if waited >= state[_LONGEST]:
            _write(_STDERR, types.uintp(state[_TEXTS]), types.uintp(state[_TEXTS + 1]))
            _exit(UNCLOSED)
        still = still + 1 if beats == state[_BEATS] and beats > 0 else 0
        beats = state[_BEATS]
        if still == state[_SAY]:
            _write(_STDERR, types.uintp(state[_TEXTS + 2]), types.uintp(state[_TEXTS + 3]))
            _kill(_getpid(), _STACKS)
        if still >= state[_STILL]:
            _write(_STDERR, types.uintp(state[_TEXTS + 4]), types.uintp(state[_TEXTS + 5]))
            _exit(HUNG)
    return 0


def _compiled() -> Any:
    signature = types.uintp(types.CPointer(types.int64))
    try:
        return cfunc(signature, cache=True)(_watch)
    except Exception:  # Whatever is wrong with the cache, as where it cannot be written.
        return cfunc(signature)(_watch)


class Watch:
    """
    Ends the process if a signal does not, or if beats that had begun do not go on.

    Time is counted in turns of the watching thread, so that a process that was stopped, or that
    gets no processor, is not taken for one that hangs.  SIGUSR1 prints the stacks.
    """

    def __init__(
        self,
        name: str,
        *,
        longest_s: float = LONGEST_S,
        say_s: float = HANGS_S / 2,
        still_s: float = HANGS_S,
    ) -> None:
        """
        Begin to watch; to be called in the main thread.

        :param name: of the process, for what is said.
        :param longest_s: time that the process has to end after SIGINT, SIGTERM or :meth:`ask`.
        :param say_s: time without a beat after which the stacks of all threads are printed.
        :param still_s: time without a beat after which the process ends.
        """
        self._heard, self._told = os.pipe()
        os.set_blocking(self._told, False)
        self._texts = [
            ctypes.create_string_buffer(f'{name}: {text}\n'.encode())
            for text in (
                f'did not end within {longest_s:g} s of a signal: ended without being closed',
                f'nothing was called back for {say_s:g} s; the stacks of all threads:',
                f'nothing was called back for {still_s:g} s: ended, to be started again',
            )
        ]
        self._state = np.zeros(_SIZE, np.int64)
        ticks = np.array([longest_s, say_s, still_s]) * 1000 / _TICK_MS
        self._state[_LONGEST : _STILL + 1] = np.maximum(ticks, 1)
        self._state[_POLLED] = self._heard | select.POLLIN << 32
        for place, text in enumerate(self._texts):
            about = ctypes.addressof(text), len(text.value)
            self._state[_TEXTS + 2 * place : _TEXTS + 2 * place + 2] = about
        self._before = signal.set_wakeup_fd(self._told, warn_on_full_buffer=False)
        faulthandler.register(signal.SIGUSR1, file=_STDERR, all_threads=True)
        self._code = _compiled()
        self._thread = ctypes.c_ulong()
        self._system = ctypes.CDLL(None)
        create = self._system.pthread_create
        create.argtypes = [ctypes.c_void_p] * 4
        where = ctypes.addressof(self._thread)
        if create(where, None, self._code.address, self._state.ctypes.data):
            raise OSError('no thread can be started')
        # The interpreter, at its end, would take away what the thread works on.
        atexit.register(self.close)

    def beat(self) -> None:
        """Say that the process turns; it must do so again within ``still_s``."""
        self._state[_BEATS] += 1

    def ask(self) -> None:
        """Have the process end within ``longest_s``, as after a signal."""
        self._state[_ASKED] = 1

    def close(self) -> None:
        """Watch no more."""
        if self._state[_OVER]:
            return
        self._state[_OVER] = 1
        atexit.unregister(self.close)
        signal.set_wakeup_fd(self._before)
        os.write(self._told, b'\0')
        self._system.pthread_join(self._thread, None)
        faulthandler.unregister(signal.SIGUSR1)
        os.close(self._heard)
        os.close(self._told)
