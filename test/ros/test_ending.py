# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Signals at any time: what they end, and that they end it quietly and in order."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from gait_segmentation.ending import Ending

ROOT = Path(__file__).resolve().parents[2]
TIMEOUT_S = 300.0
# Without shared memory: of what others have left there Fast DDS writes to the standard output.
ALONE = {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'OFF', 'FASTDDS_BUILTIN_TRANSPORTS': 'UDPv4'}
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

NODE = """
import ctypes, sys, time
from rclpy.node import Node
from gait_segmentation import ending
from gait_segmentation.ros import running

def wait():
    print('starting', flush=True)
    # In short pieces: a signal just before a sleep is not noticed before its end.
    while True:
        time.sleep(0.05)

def wait_a_little():
    print('starting', flush=True)
    time.sleep(0.2)

def swallow():
    try:
        wait()
    except BaseException:
        pass

def hang(library):
    # Locked twice.
    mutex = ctypes.create_string_buffer(64)
    for _ in range(2):
        library.pthread_mutex_lock(mutex)

call_back = ctypes.CFUNCTYPE(None)(wait)

class Quiet(Node):
    def __init__(self):
        super().__init__('quiet')
    def start(self):
        {start}
        print('started', flush=True)
        return True
    def compile(self, work):
        with self.unhurried():
            work()
    def close(self):
        print('closed', flush=True)
        {close}

ending.LONGEST_S, ending.HANGS_S = {longest}, {hangs}
# What others have left is nothing of this test.
running.remove_dead_segments = lambda: 0
sys.exit(running.run_node(Quiet, ['quiet']))
"""


SIGNALLED = """
import signal
from gait_segmentation.ending import Ending

ending = Ending(lambda: None, at_once={at_once})
ending.closes(lambda: print('closed'))
ending.handle_signals()
signal.raise_signal(signal.SIGTERM)
print('went on')
signal.raise_signal(signal.SIGINT)
print('went on for ever')
"""

BUSY = """self.create_timer(0.01, lambda: (wait_a_little(), print('done', flush=True)))"""

pytestmark = pytest.mark.usefixtures('signal_handlers')


def _begin(
    start: str = 'pass', close: str = 'pass', longest: float = 100.0, hangs: float = 100.0
) -> subprocess.Popen[str]:
    script = NODE.format(start=start, close=close, longest=longest, hangs=hangs)
    return subprocess.Popen(
        [sys.executable, '-c', script],
        cwd=ROOT,
        env={**os.environ, **ALONE},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


def _line(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None
    return process.stdout.readline().strip()


@pytest.mark.parametrize(
    ('work', 'number'), list(zip(('wait', 'swallow', 'call_back'), SIGNALS, strict=True))
)
def test_one_signal_breaks_off_a_start_wherever_it_is(work: str, number: signal.Signals) -> None:
    """Also where an exception would be printed and forgotten, as in a compiler's callbacks."""
    with _begin(f'self.compile({work})') as process:
        assert _line(process) == 'starting'
        process.send_signal(number)
        said, _ = process.communicate(timeout=TIMEOUT_S)
    assert (process.returncode, said) == (0, 'closed\n')


@pytest.mark.parametrize(
    ('start', 'close', 'said'),
    [('pass', 'time.sleep(100)', 'closed\n'), ('wait()', 'pass', '')],
)
def test_a_signal_ends_what_cannot_be_closed(start: str, close: str, said: str) -> None:
    with _begin(start, close, longest=0.5) as process:
        assert _line(process) == ('starting' if said == '' else 'started')
        process.send_signal(signal.SIGINT)
        rest, _ = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == 1
    assert rest.startswith(said + 'Timeout (0:00:00.5')
    assert ' in wait\n' in rest or ' in close\n' in rest


@pytest.mark.parametrize('library', ['PyDLL', 'CDLL'])
def test_what_hangs_is_ended_with_its_stacks_whatever_it_hangs_in(library: str) -> None:
    """Also with the interpreter's lock held."""
    hang = f'self.create_timer(0.01, lambda: hang(ctypes.{library}(None)))'
    with _begin(hang, hangs=2.5) as process:
        said, _ = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == 1
    assert 'Timeout (0:00:02.5' in said
    assert ' in hang\n' in said


@pytest.mark.parametrize(('at_once', 'said'), [(True, 'closed\n'), (False, 'went on\nclosed\n')])
def test_the_first_signal_or_the_second_ends_the_process_from_within(
    at_once: bool, said: str
) -> None:
    script = SIGNALLED.format(at_once=at_once)
    done = subprocess.run([sys.executable, '-c', script], cwd=ROOT, capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (0, said, '')


def test_once_started_what_runs_is_done_before_the_end() -> None:
    with _begin(BUSY) as process:
        assert [_line(process), _line(process)] == ['started', 'starting']
        process.send_signal(signal.SIGINT)
        said, _ = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == 0
    assert said.startswith('done\n')
    assert said.endswith('closed\n')


def test_any_number_of_signals_ends_a_node_in_order() -> None:
    for pause_s in (0.0, 0.0001, 0.001, 0.005):
        with _begin() as process:
            assert _line(process) == 'started'
            while process.poll() is None:
                process.send_signal(signal.SIGINT)
                time.sleep(pause_s)
            said, _ = process.communicate()
            # Python itself may say of the last one that it came while its handler was changed.
            assert 'KeyboardInterrupt' not in said
            assert 'closed' in said
            assert process.returncode == 0, said


def test_the_first_signal_is_noted_and_none_does_anything_after_the_end() -> None:
    closed: list[str] = []
    ending = Ending(lambda: None)
    ending.closes(lambda: closed.append('first'))
    ending.closes(lambda: closed.append('second'))
    ending.handle_signals()
    assert not ending.asked
    signal.raise_signal(signal.SIGTERM)
    assert ending.asked
    assert closed == []
    ending.close()
    assert closed == ['first', 'second']
    signal.raise_signal(signal.SIGINT)
    # One that was on its way when the handlers were changed.
    ending(signal.SIGINT, None)
    ending.close()
    assert closed == ['first', 'second']
