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
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rcl_interfaces.msg import Parameter as ParameterMessage, ParameterValue
from rcl_interfaces.srv import SetParameters
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Image

from gait_segmentation.errors import ConfigError, SequenceError
from gait_segmentation.nodes.source_node import Pace, _wait_for, parser, publish_input
from gait_segmentation.streams.fields import stamp_of
from test.inputs.bags import greys, stamp, write_bag2
from test.nodes.bench import TIMEOUT_S, Bench

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
        (['matcher', *LONG], 1, 'error: Invalid service name: topic length should not'),
        (['source', 'x.mp4', *LONG], 2, 'error: Invalid service name: topic length should'),
        (['source', 'no_such_film.mp4'], 2, 'does not exist'),
        (['source', 'x', '--ros-args', '-r', 'image'], 2, 'Failed to parse ROS arguments'),
        (
            ['source', str(ROOT / 'docs/images'), '--stamps', str(ROOT / 'test')],
            2,
            'test: Is a directory',
        ),
        (
            ['source', str(ROOT / 'docs/images'), '--stamps', '/dev/full'],
            2,
            'gait_source: error: /dev/full: No space left on device\n',
        ),
    ],
)
def test_what_cannot_be_used_ends_a_node_with_the_reason(
    start: Start, command: list[str], code: int, reason: str
) -> None:
    assert reason in finish(start(*command), code)


def test_gait_source_plays_a_folder_with_real_stamps(
    bench: Bench, start: Start, tmp_path: Path
) -> None:
    film = tmp_path / 'film'
    film.mkdir()
    for index in range(6):
        cv2.imwrite(str(film / f'{index:03d}.png'), np.full((40, 60, 3), 40 * index, np.uint8))
    stamps = tmp_path / 'stamps.txt'
    process = start(
        'source', str(film), '--rate', '50', '--width', '30', '--start', '1',
        '--count', '4', '--wait-for', '1', '--stamps', str(stamps),
    )  # fmt: skip
    images: list[Image] = []
    bench.probe.create_subscription(Image, 'image', images.append, 20)
    bench.until(lambda: len(images) == 4, 'the images')
    finish(process)
    assert [(m.width, m.height, m.encoding) for m in images] == [(30, 20, 'bgr8')] * 4
    assert [m.data[0] for m in images] == [40, 80, 120, 160]
    written = [tuple(map(int, line.split())) for line in stamps.read_text().splitlines()]
    assert written == [(1 + index, stamp_of(m.header)) for index, m in enumerate(images)]
    assert written == sorted(set(written))


def test_gait_source_plays_a_bag_with_its_own_stamps_and_a_clock(
    bench: Bench, start: Start, tmp_path: Path
) -> None:
    bag = write_bag2(tmp_path / 'walk', {'/camera/image_raw': greys(5)})
    images: list[Image] = []
    clocks: list[Clock] = []
    # The clock first: endpoints become known in the order in which they are made, and
    # gait_source waits for the images' only.
    bench.probe.create_subscription(Clock, '/clock', clocks.append, 20)
    bench.probe.create_subscription(Image, 'image', images.append, 20)

    def ticks() -> list[int]:
        return [clock.clock.sec * 10**9 + clock.clock.nanosec for clock in clocks]

    process = start('source', str(bag), '--keep-stamps', '--clock', '--wait-for', '1')
    bench.until(lambda: len(images) == 5 and ticks()[-1:] == [stamp(4)], 'images and clock')
    finish(process)
    assert [stamp_of(message.header) for message in images] == [stamp(n) for n in range(5)]
    assert {message.header.frame_id for message in images} == {'head_camera'}
    assert ticks() == [stamp(n) for n in range(5)]


def test_the_pace_follows_the_stamps_or_the_rate() -> None:
    pace = Pace(0.1, by_stamp=True)
    first, second = 10**9, 10**9 + 40_000_000
    assert pace.due_s(first, 7.0) == 7.0
    assert pace.due_s(second, 7.001) == pytest.approx(7.04)
    # Held up: no catching up. A stamp that goes back, or a long gap: one period.
    assert pace.due_s(second + 40_000_000, 9.0) == 9.0
    assert pace.due_s(first, 9.01) == pytest.approx(9.1)
    assert pace.due_s(first + 10**11, 9.11) == pytest.approx(9.2)
    even = Pace(0.1, by_stamp=False)
    assert [even.due_s(stamp, 1.0) for stamp in (5, 6, 500)] == pytest.approx([1.0, 1.1, 1.2])


@pytest.mark.parametrize(
    ('options', 'reason'),
    [
        (['--delay', 'nan'], '--delay must be from 0 to 86400, got nan'),
        (['--wait-timeout', 'nan'], '--wait-timeout must be from 0 to 86400, got nan'),
        (['--wait-for', '-1'], '--wait-for must be from 0 to 1000, got -1'),
        (['--rate', '1e-300'], 'rate must be 0, or from 0.01 to 1000 Hz, got 1e-300'),
        (['--start', str(10**21)], 'start must be from 0 to 2147483647'),
    ],
)
def test_gait_source_refuses_odd_numbers(options: list[str], reason: str) -> None:
    given = parser().parse_args([str(ROOT / 'docs/images'), *options])
    with pytest.raises((ConfigError, SequenceError), match=re.escape(reason)):
        publish_input(given, SimpleNamespace())


def test_gait_source_does_not_write_stamps_over_its_input(tmp_path: Path) -> None:
    film = tmp_path / 'film.mp4'
    film.write_bytes(b'a film')
    (tmp_path / 'stamps.txt').hardlink_to(film)
    options = parser().parse_args([str(film), '--stamps', str(tmp_path / 'stamps.txt')])
    with pytest.raises(ConfigError, match=r'--stamps .* is the input .*film\.mp4'):
        publish_input(options, SimpleNamespace())
    assert film.read_bytes() == b'a film'


@pytest.mark.parametrize(('known', 'more'), [(1, ''), (3, ', and 2 that want another type or')])
def test_only_subscribers_that_can_take_the_images_are_waited_for(known: int, more: str) -> None:
    publisher = SimpleNamespace(topic_name='/image', get_subscription_count=lambda: 1)
    node = SimpleNamespace(count_subscribers={'/image': known}.get)
    _wait_for(node, publisher, 1, 0.0)
    with pytest.raises(SequenceError, match=f'--wait-for 2: only 1 on /image within 0 s{more}'):
        _wait_for(node, publisher, 2, 0.0)
