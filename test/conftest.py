# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What holds for all tests."""

from __future__ import annotations

import signal
import threading

# A shell ignores Ctrl-C in what it runs in the background, and processes inherit that.
_ignored = signal.getsignal(signal.SIGINT) == signal.SIG_IGN
if _ignored and threading.current_thread() is threading.main_thread():
    signal.signal(signal.SIGINT, signal.default_int_handler)
