# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What hangs is ended, even with the interpreter's lock held, and nothing else is."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from gait_segmentation.ros.watch import HUNG, UNCLOSED, Watch

ROOT = Path(__file__).resolve().parents[2]

HANGING = """
import ctypes, signal, time
from gait_segmentation.ros.watch import Watch

def hang_with_the_lock():
    # Locked twice, in a call that keeps the lock of the interpreter.
    mutex = ctypes.create_string_buffer(64)
    for _ in range(2):
        ctypes.PyDLL(None).pthread_mutex_lock(mutex)

def hang():
    mutex = ctypes.create_string_buffer(64)
    for _ in range(2):
        ctypes.CDLL(None).pthread_mutex_lock(mutex)

signal.signal(signal.SIGTERM, lambda *_: None)
watch = Watch('it', longest_s={longest}, say_s={say}, still_s={still})
{begin}
print('hanging', flush=True)
{hang}()
"""


def _hanging(
    how: str, begin: str = '', longest: float = 60.0, say: float = 60.0, still: float = 60.0
) -> subprocess.Popen[str]:
    script = HANGING.format(hang=how, begin=begin, longest=longest, say=say, still=still)
    process = subprocess.Popen(
        [sys.executable, '-c', script],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == 'hanging\n'
    return process


@pytest.mark.parametrize('how', ['hang', 'hang_with_the_lock'])
def test_a_signal_ends_what_hangs_whatever_it_hangs_in(how: str) -> None:
    with _hanging(how, longest=0.3) as process:
        process.send_signal(signal.SIGTERM)
        said, _ = process.communicate(timeout=60)
    assert process.returncode == UNCLOSED
    assert said == 'it: did not end within 0.3 s of a signal: ended without being closed\n'


def test_what_does_not_turn_any_more_is_said_with_the_stacks_and_ended() -> None:
    with _hanging('hang_with_the_lock', 'watch.beat()', say=0.2, still=0.8) as process:
        said, _ = process.communicate(timeout=60)
    assert process.returncode == HUNG
    assert said.startswith('it: nothing was called back for 0.2 s; the stacks of all threads:\n')
    assert 'in hang_with_the_lock' in said
    assert said.endswith('it: nothing was called back for 0.8 s: ended, to be started again\n')


def test_what_was_stopped_for_a_while_is_not_taken_for_hanging() -> None:
    begin = 'beats = __import__("threading").Event()\nwatch.beat()'
    turning = """
while True:
    print(input(), flush=True)
    watch.beat()
""".strip()
    script = HANGING.format(hang='id', begin=begin, longest=9, say=9, still=1.5).replace(
        'id()', turning
    )
    process = subprocess.Popen(
        [sys.executable, '-c', script], cwd=ROOT, text=True,
        stdin=subprocess.PIPE, stdout=subprocess.PIPE,
    )  # fmt: skip
    with process:
        assert process.stdin is not None
        assert process.stdout is not None
        assert process.stdout.readline() == 'hanging\n'
        process.send_signal(signal.SIGSTOP)
        os.waitid(os.P_PID, process.pid, os.WSTOPPED)
        with pytest.raises(subprocess.TimeoutExpired):
            process.wait(timeout=2.5)
        process.send_signal(signal.SIGCONT)
        process.stdin.write('alive\n')
        process.stdin.flush()
        assert process.stdout.readline() == 'alive\n'
        process.kill()


@pytest.mark.usefixtures('signal_handlers')
def test_a_watch_that_is_closed_leaves_nothing() -> None:
    signal.signal(signal.SIGTERM, lambda *_: None)
    # What the first one compiles stays open.
    Watch('it').close()
    before = sorted(os.listdir('/proc/self/fd')), len(os.listdir('/proc/self/task'))
    watch = Watch('it', longest_s=0.1, say_s=0.1, still_s=0.1)
    watch.close()
    watch.close()
    assert (sorted(os.listdir('/proc/self/fd')), len(os.listdir('/proc/self/task'))) == before
    assert signal.set_wakeup_fd(-1) == -1
