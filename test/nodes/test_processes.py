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
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rcl_interfaces.msg import Parameter as ParameterMessage, ParameterValue
from rcl_interfaces.srv import SetParameters
from sensor_msgs.msg import Image

from test.nodes.bench import Bench, finish

ROOT = Path(__file__).parents[2]

Start = Callable[..., subprocess.Popen[str]]


@pytest.fixture
def start() -> Iterator[Start]:
    """Return what starts a node as a process that does not outlive the test."""
    started: list[subprocess.Popen[str]] = []

    def begin(module: str | Path, *arguments: str) -> subprocess.Popen[str]:
        node = ['-m', f'gait_segmentation.nodes.{module}_node']
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


@pytest.mark.parametrize(
    ('example', 'number'),
    [(False, signal.SIGTERM), (True, signal.SIGINT)],
    ids=['node', 'example of two in a process'],
)
def test_a_node_ends_cleanly(
    bench: Bench, start: Start, bank_file: Path, tmp_path: Path, number, example: bool
) -> None:
    (code,) = re.findall(
        r'```python\n(.*?)```', (ROOT / 'docs/ros_howto.md').read_text(), re.DOTALL
    )
    script = tmp_path / 'own.py'
    script.write_text(code)
    topics = ('left/image', 'right/image') if example else ('image',)
    process = start(script if example else 'tracker', '--ros-args', '-p', f'bank:={bank_file}')
    for camera in [bench.probe.create_publisher(Image, topic, 10) for topic in topics]:
        bench.until(lambda c=camera: c.get_subscription_count() == 1, 'a node')
    process.send_signal(number)
    finish(process)


def test_requests_that_ros_cannot_take_do_not_end_a_node(bench: Bench, start: Start) -> None:
    process = start('segmenter')
    change = bench.probe.create_client(ChangeState, 'gait_segmenter/change_state')
    put = bench.probe.create_client(SetParameters, 'gait_segmenter/set_parameters')
    bench.until(lambda: change.service_is_ready() and put.service_is_ready(), 'the node')
    odd = ParameterMessage(name='backlog', value=ParameterValue(type=26))
    put.call_async(SetParameters.Request(parameters=[odd]))
    change.call_async(ChangeState.Request(transition=Transition(id=77)))
    asked = change.call_async(ChangeState.Request(transition=Transition(id=4)))
    bench.until(asked.done, 'the answer')
    assert asked.result().success
    process.send_signal(signal.SIGINT)
    assert 'refused: ' in finish(process)


LONG = ['--ros-args', '-r', f'__ns:=/{"a" * 240}']


@pytest.mark.parametrize(
    ('command', 'code', 'reason'),
    [
        (
            ['segmenter', '--ros-args', '-p', 'segmentation.prior:=magic'],
            1,
            'prior must be one of none, default, paper',
        ),
        (['matcher', '--ros-args', '--params-file', 'nosuch.yaml'], 2, 'nosuch.yaml'),
        (['matcher', '--ros-args', '-r', 'a:=b:='], 2, 'gait_matcher: error: '),
        (['matcher', *LONG], 1, 'error: Invalid service name: topic length should not'),
    ],
)
def test_what_cannot_be_used_ends_a_node_with_the_reason(
    start: Start, command: list[str], code: int, reason: str
) -> None:
    assert reason in finish(start(*command), code)
