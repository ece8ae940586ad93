# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytest.importorskip('rclpy', reason='needs ROS 2: rclpy cannot be imported')

from gait_tools.demo import nodes
from gait_tools.demo.nodes import ProcessError, ProcessGroup

TIMEOUT_S = 120.0

# In short pieces: a signal that comes between what Python does last and the beginning of a sleep
# is not noticed before its end.
SLEEP = 'import time\nprint("ready", flush=True)\nfor _ in range(12000): time.sleep(0.05)\n'
STUBBORN = 'import signal\nsignal.signal(signal.SIGINT, signal.SIG_IGN)\n' + SLEEP


@pytest.fixture
def group(tmp_path: Path, monkeypatch) -> ProcessGroup:
    """Return processes that are told to run code in place of a command."""
    code = 'import sys; exec(sys.argv[1])'
    words = [sys.executable, '-c', code]
    popen = subprocess.Popen
    monkeypatch.setattr(
        subprocess, 'Popen', lambda given, **more: popen(words + given[2:], **more)
    )
    return ProcessGroup(tmp_path / 'logs')


def wait_for(ready, what: str) -> None:
    deadline = time.monotonic() + TIMEOUT_S
    while not ready():
        assert time.monotonic() < deadline, f'waited in vain for {what}'
        time.sleep(0.01)


def start(group: ProcessGroup, name: str, code: str) -> None:
    group.start(name, code)
    wait_for(lambda: 'ready' in group.last_lines(name), f'output of {name}')


def test_one_of_them_can_be_stopped_and_the_end_of_the_context_stops_all(
    group: ProcessGroup, monkeypatch
) -> None:
    monkeypatch.setattr(nodes, '_GRACE_S', TIMEOUT_S)
    with group:
        for name in ('one', 'two', 'three'):
            start(group, name, SLEEP)
        group.check_running('one', 'two', 'three')
        group.stop('one')
        assert [group.ended(name) for name in ('one', 'two', 'three')] == [True, False, False]
    # By the interrupt: nobody waited for them to be killed.
    assert all(group.ended(name) for name in ('one', 'two', 'three'))


def test_a_process_that_fails_or_has_to_be_killed_is_named(
    group: ProcessGroup, monkeypatch
) -> None:
    monkeypatch.setattr(nodes, '_GRACE_S', 0.2)
    with group:
        start(group, 'stubborn', STUBBORN)
        group.start('failing', 'raise OSError(7)')
        wait_for(lambda: group.ended('failing'), 'the end')
        with pytest.raises(ProcessError, match=r'failing ended with code 1[^$]*OSError: 7'):
            group.check_running()
    with pytest.raises(ProcessError, match='stubborn was killed by signal 9'):
        group.check_running('stubborn')
