# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The nodes as processes: starting, Ctrl-C, errors."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from sensor_msgs.msg import Image

from test.nodes.bench import TIMEOUT_S, Bench

ROOT = Path(__file__).parents[2]

Start = Callable[..., subprocess.Popen[str]]


@pytest.fixture
def start() -> Iterator[Start]:
    """Return what starts a node as a process that does not outlive the test."""
    started: list[subprocess.Popen[str]] = []

    def begin(module: str | Path, *arguments: str) -> subprocess.Popen[str]:
        node = ['-m', 'gait_segmentation', module]
        process = subprocess.Popen(
            [sys.executable, *([str(module)] if isinstance(module, Path) else node), *arguments],
            env={**os.environ, 'PYTHONPATH': str(ROOT)},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        started.append(process)
        return process

    yield begin
    for process in started:
        process.kill()
        process.communicate()


def finish(process: subprocess.Popen[str], code: int = 0) -> str:
    """Return what a process has said, having checked that it ended as it should."""
    output, _ = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == code, output
    assert 'Traceback' not in output
    return output


@pytest.mark.parametrize('example', [False, True], ids=['node', 'example of two in a process'])
@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_node_ends_cleanly(
    bench: Bench, start: Start, bank_file: Path, tmp_path: Path, number, example: bool
) -> None:
    (code,) = re.findall(r'```python\n(.*?)```', (ROOT / 'docs/ros.md').read_text(), re.DOTALL)
    script = tmp_path / 'own.py'
    script.write_text(code)
    topics = ('left/image', 'right/image') if example else ('image',)
    process = start(script if example else 'tracker', '--ros-args', '-p', f'bank:={bank_file}')
    for camera in [bench.probe.create_publisher(Image, topic, 10) for topic in topics]:
        bench.until(lambda c=camera: c.get_subscription_count() == 1, 'a node')
    process.send_signal(number)
    finish(process)


@pytest.mark.skipif(not Path('/dev/shm').is_dir(), reason='needs shared memory with names')
def test_a_node_that_is_started_again_does_not_read_where_a_killed_one_did(start: Start) -> None:
    killed = start('segmenter')
    port = port_of(killed)
    killed.kill()
    killed.wait()
    assert port_of(start('segmenter')) != port


def port_of(process: subprocess.Popen[str]) -> str:
    """Return the port of user data of this domain that a node reads from once it is active."""
    assert process.stdout is not None
    assert any('active' in line for line in process.stdout)
    first = 7400 + 250 * int(os.environ['ROS_DOMAIN_ID'])
    found = []
    for each in Path(f'/proc/{process.pid}/fd').iterdir():
        named = re.search(r'_port(\d+)_el$', str(each.readlink()))
        # Something is written to the locks of the dead.
        if named and 0 < int(named[1]) - first < 250 and not each.stat().st_size:
            found.append(named[1])
    (port,) = found
    return port


LONG = ['--ros-args', '-r', f'__ns:=/{"a" * 240}']


@pytest.mark.parametrize(
    ('command', 'code', 'reason'),
    [
        (
            ['segmenter', '--ros-args', '-p', 'segmentation.prior:=magic'],
            1,
            'prior must be one of none, default, paper',
        ),
        (['matcher', *LONG], 1, 'error: Invalid service name: topic length should not'),
    ],
)
def test_what_cannot_be_used_ends_a_node_with_the_reason(
    start: Start, command: list[str], code: int, reason: str
) -> None:
    assert reason in finish(start(*command), code)
