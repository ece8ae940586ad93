# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Freed memory that is used again, in a process of its own."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = """
import ctypes, resource, sys
from gait_segmentation.ros.memory import keep_freed_memory
keep = sys.argv[1] == 'keep'
if keep and not keep_freed_memory():
    print('cannot')
    sys.exit()
libc = ctypes.CDLL(None)
libc.malloc.restype = ctypes.c_void_p
libc.free.argtypes = [ctypes.c_void_p]
def images():
    blocks = [libc.malloc(2_700_000) for _ in range(4)]
    for block in blocks:
        ctypes.memset(block, 1, 2_700_000)
    for block in blocks:
        libc.free(block)
for _ in range(3):
    images()
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
for _ in range(10):
    images()
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


AHEAD = """
import resource, sys, threading
import numpy as np
from gait_segmentation.ros.memory import keep_freed_memory, take_ahead
if not keep_freed_memory():
    print('cannot')
    sys.exit()
if sys.argv[1] == 'ahead':
    take_ahead()
def work():
    before = resource.getrusage(resource.RUSAGE_THREAD).ru_minflt
    images = [np.ones((720, 1280, 3), np.uint8) for _ in range(4)]
    print(resource.getrusage(resource.RUSAGE_THREAD).ru_minflt - before)
worker = threading.Thread(target=work)
worker.start()
worker.join()
"""


def _faults(how: str, script: str = SCRIPT) -> str:
    root = Path(__file__).resolve().parents[2]
    done = subprocess.run(
        [sys.executable, '-c', script, how], cwd=root, capture_output=True, text=True, check=True
    )
    return done.stdout.strip()


def test_images_are_written_to_the_memory_of_those_before() -> None:
    kept = _faults('keep')
    if kept == 'cannot':
        pytest.skip('the C library is not glibc')
    assert int(kept) < 100 < int(_faults('return'))


def test_a_thread_finds_the_pages_of_its_first_images_made() -> None:
    made = _faults('ahead', AHEAD)
    if made == 'cannot':
        pytest.skip('the C library is not glibc')
    assert int(made) < 500 < 2000 < int(_faults('not', AHEAD))
