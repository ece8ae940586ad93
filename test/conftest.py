# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What holds for all tests."""

from __future__ import annotations

import contextlib
import gc
import importlib
import os
import pkgutil
import signal
import threading

from hypothesis import HealthCheck, settings

import gait_segmentation
import gait_tools

# Before anything reads it: with several workers, threads of OpenMP mostly wait for each other.
os.environ.setdefault('OMP_NUM_THREADS', '1')

# The same examples in every run, however busy the computer is.  `make fuzz` chooses the other,
# which draws at random and prints what brings a failure back.
_UNTIMED = {'deadline': None, 'suppress_health_check': [HealthCheck.too_slow]}
settings.register_profile('gate', derandomize=True, database=None, **_UNTIMED)
settings.register_profile('fuzz', database=None, print_blob=True, **_UNTIMED)
settings.load_profile('gate')

# A shell ignores Ctrl-C in what it runs in the background, nohup that the terminal is closed, and
# processes inherit that.
if threading.current_thread() is threading.main_thread():
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if signal.getsignal(signal.SIGHUP) == signal.SIG_IGN:
        signal.signal(signal.SIGHUP, signal.SIG_DFL)


def pytest_collection_finish() -> None:
    """
    Import both packages, whole, before any test.

    Hypothesis tries the constants of all modules of the project that are loaded, so the examples
    would depend on the tests that are chosen and on those that ran before.
    """
    for package in (gait_segmentation, gait_tools):
        for module in pkgutil.walk_packages(package.__path__, f'{package.__name__}.'):
            # Without ROS 2 some cannot be.
            with contextlib.suppress(ImportError):
                importlib.import_module(module.name)
    # What all these are made of stays, and need not be looked through by every collection.
    gc.collect()
    gc.freeze()
