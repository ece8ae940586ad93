# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from gait_segmentation.cli import processes
from gait_segmentation.cli.processes import ProcessError, ProcessGroup

TIMEOUT_S = 120.0

# In short pieces: a signal that comes between what Python does last and the beginning of a sleep
# is not noticed before its end.
SLEEP = 'import time\nprint("ready", flush=True)\nfor _ in range(12000): time.sleep(0.05)\n'
STUBBORN = 'import signal\nsignal.signal(signal.SIGINT, signal.SIG_IGN)\n' + SLEEP
PARENT = """\
import os, pathlib, signal, sys
from gait_segmentation.cli.processes import ProcessGroup
group = ProcessGroup(os.environ, pathlib.Path(sys.argv[1]))
group.start('child', 'sleeper')
print(group._children['child'].pid, flush=True)
os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.fixture
def group(tmp_path: Path) -> ProcessGroup:
    for name, code in (
        ('sleeper', SLEEP),
        ('stubborn', STUBBORN),
        ('failing', 'raise OSError(7)'),
    ):
        (tmp_path / f'{name}.py').write_text(code)
    return ProcessGroup({**os.environ, 'PYTHONPATH': str(tmp_path)}, tmp_path / 'logs')


def wait_for(ready, what: str) -> None:
    deadline = time.monotonic() + TIMEOUT_S
    while not ready():
        assert time.monotonic() < deadline, f'waited in vain for {what}'
        time.sleep(0.01)


def wait_for_output(group: ProcessGroup, name: str) -> None:
    wait_for(lambda: 'ready' in group.last_lines(name), f'output of {name}')


def alive(pid: int) -> bool:
    try:
        return Path(f'/proc/{pid}/stat').read_text().rsplit(')', 1)[1].split()[0] != 'Z'
    except (FileNotFoundError, ProcessLookupError):
        return False


def test_one_of_them_can_be_stopped_and_the_end_of_the_context_stops_all(
    group: ProcessGroup, monkeypatch
) -> None:
    monkeypatch.setattr(processes, '_GRACE_S', TIMEOUT_S)
    with group:
        for name in ('one', 'two', 'three'):
            group.start(name, 'sleeper')
            wait_for_output(group, name)
        group.check_running('one', 'two', 'three')
        group.stop('one')
        assert [group.ended(name) for name in ('one', 'two', 'three')] == [True, False, False]
    codes = [child.returncode for child in group._children.values()]
    # By the interrupt, so that nobody had to be killed.
    assert not {None, -signal.SIGKILL} & set(codes)


def test_a_process_that_ignores_interrupts_is_killed_and_named(
    group: ProcessGroup, monkeypatch
) -> None:
    monkeypatch.setattr(processes, '_GRACE_S', 0.2)
    with group:
        group.start('stubborn', 'stubborn')
        wait_for_output(group, 'stubborn')
    assert group._children['stubborn'].returncode == -signal.SIGKILL
    with pytest.raises(ProcessError, match='stubborn was killed by signal 9'):
        group.check_running()


def test_a_process_that_fails_is_named_with_its_last_lines(group: ProcessGroup) -> None:
    with group:
        group.start('failing', 'failing')
        wait_for(lambda: group.ended('failing'), 'the end')
        with pytest.raises(ProcessError, match=r'failing ended with code 1[^$]*OSError: 7'):
            group.check_running()


@pytest.mark.skipif(sys.platform != 'linux', reason='the kernel does this on Linux only')
def test_processes_do_not_outlive_a_parent_that_is_killed(group, tmp_path: Path) -> None:
    root = str(Path(__file__).parents[2])
    done = subprocess.run(
        [sys.executable, '-c', PARENT, str(tmp_path / 'logs')],
        env={**os.environ, 'PYTHONPATH': f'{tmp_path}{os.pathsep}{root}'},
        capture_output=True,
        text=True,
        timeout=TIMEOUT_S,
    )
    child = int(done.stdout)
    wait_for(lambda: not alive(child), 'the end of the child')


def test_an_interrupt_while_a_process_starts_leaves_no_stray(
    group: ProcessGroup, monkeypatch
) -> None:
    popen = subprocess.Popen

    def interrupted(*arguments, **options):
        made = popen(*arguments, **options)
        signal.raise_signal(signal.SIGINT)
        return made

    monkeypatch.setattr(subprocess, 'Popen', interrupted)
    with pytest.raises(KeyboardInterrupt):
        group.start('child', 'sleeper')
    pid = group.pid('child')
    assert alive(pid)
    group.stop()
    assert not alive(pid)


def test_of_a_long_log_the_end_is_shown(group: ProcessGroup, tmp_path: Path) -> None:
    (tmp_path / 'talker.py').write_text('for k in range(99): print("line", k)\nprint("ready")')
    with group:
        group.start('talker', 'talker')
        wait_for_output(group, 'talker')
        said = group.last_lines('talker').splitlines()
    assert said == [*(f'    line {k}' for k in range(85, 99)), '    ready']
