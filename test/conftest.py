# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What holds for all tests."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator

import pytest

# Before anything reads it: with several workers, threads of OpenMP mostly wait for each other.
os.environ.setdefault('OMP_NUM_THREADS', '1')

# A shell ignores Ctrl-C in what it runs in the background, and processes inherit that.
_ignored = signal.getsignal(signal.SIGINT) == signal.SIG_IGN
if _ignored and threading.current_thread() is threading.main_thread():
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def signal_handlers() -> Iterator[None]:
    """Put the handlers of the signals that end a process back after a test."""
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.getsignal(number) for number in numbers]
    yield
    for number, handler in zip(numbers, before, strict=True):
        signal.signal(number, handler)
