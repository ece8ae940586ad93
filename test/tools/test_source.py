# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""gait_source as a process."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs ROS 2: rclpy cannot be imported')

import rclpy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Image

from gait_segmentation.streams.fields import stamp_of
from gait_tools.cli.source import Pace, main
from test.inputs.bags import greys, stamp, write_bag2
from test.nodes.bench import TIMEOUT_S, finish

ROOT = Path(__file__).parents[2]
# Of what rclpy imports with its first node.
pytestmark = pytest.mark.filterwarnings('ignore::DeprecationWarning')

Start = Callable[..., subprocess.Popen[str]]


@pytest.fixture
def start(monkeypatch) -> Iterator[Start]:
    """Return what starts the command as a process that does not outlive the test."""
    # Apart from other systems, other workers of pytest-xdist and the tests of nodes.
    monkeypatch.setenv('ROS_DOMAIN_ID', str(20 + os.getpid() % 80))
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    started = []

    def begin(*arguments: object) -> subprocess.Popen[str]:
        pipe = {'stdout': subprocess.PIPE, 'stderr': subprocess.STDOUT, 'text': True}
        command = [sys.executable, '-m', 'gait_tools.cli.source', *map(str, arguments)]
        started.append(subprocess.Popen(command, cwd=ROOT, **pipe))
        return started[-1]

    yield begin
    for process in started:
        process.kill()
        process.communicate()


@pytest.fixture
def probe(start: Start) -> Iterator[Any]:
    """Return a node that hears what is published."""
    context = rclpy.Context()
    rclpy.init(context=context)
    node = rclpy.create_node('probe', context=context)
    yield node
    # Else gait_source of the next test may find these subscribers, and begin for them.
    node.destroy_node()
    rclpy.try_shutdown(context=context)


def spin(probe: Any, until: Callable[[], bool]) -> None:
    executor = rclpy.executors.SingleThreadedExecutor(context=probe.context)
    executor.add_node(probe)
    deadline = time.monotonic() + TIMEOUT_S
    try:
        while not until():
            assert time.monotonic() < deadline
            executor.spin_once(0.1)
    finally:
        executor.shutdown()


@pytest.fixture
def film(tmp_path: Path) -> Path:
    path = tmp_path / 'film'
    path.mkdir()
    for index in range(6):
        cv2.imwrite(str(path / f'{index:03d}.png'), np.full((40, 60, 3), 40 * index, np.uint8))
    return path


def test_a_folder_is_played_with_the_time_of_publishing(
    probe: Any, start: Start, film: Path, tmp_path: Path
) -> None:
    images: list[Image] = []
    probe.create_subscription(Image, 'image', images.append, 20)
    stamps = tmp_path / 'stamps.txt'
    options = ('--rate', 50, '--width', 30, '--start', 1, '--count', 4, '--wait-for', 1)
    process = start(film, *options, '--stamps', stamps)
    spin(probe, lambda: len(images) == 4)
    finish(process)
    assert [(m.width, m.height, m.encoding) for m in images] == [(30, 20, 'bgr8')] * 4
    assert [m.data[0] for m in images] == [40, 80, 120, 160]
    written = [tuple(map(int, line.split())) for line in stamps.read_text().splitlines()]
    assert written == [(1 + index, stamp_of(m.header)) for index, m in enumerate(images)]
    assert written == sorted(set(written))


def test_a_bag_is_played_with_its_own_stamps_and_a_clock(
    probe: Any, start: Start, tmp_path: Path
) -> None:
    bag = write_bag2(tmp_path / 'walk', {'/camera/image_raw': greys(5)})
    images: list[Image] = []
    ticks: list[int] = []
    # The clock first, and a delay: gait_source waits for the images' subscriber only.
    probe.create_subscription(
        Clock, '/clock', lambda m: ticks.append(m.clock.sec * 10**9 + m.clock.nanosec), 20
    )
    probe.create_subscription(Image, 'image', images.append, 20)
    process = start(bag, '--keep-stamps', '--clock', '--wait-for', 1, '--delay', 1)
    spin(probe, lambda: len(images) == 5 and ticks[-1:] == [stamp(4)])
    finish(process)
    assert [stamp_of(message.header) for message in images] == [stamp(n) for n in range(5)]
    assert {message.header.frame_id for message in images} == {'head_camera'}
    assert ticks == [stamp(n) for n in range(5)]


def test_a_signal_ends_it_without_an_error(probe: Any, start: Start, film: Path) -> None:
    images: list[Image] = []
    probe.create_subscription(Image, 'image', images.append, 20)
    process = start(film, '--loop', '--wait-for', 1)
    spin(probe, lambda: bool(images))
    process.send_signal(signal.SIGTERM)
    finish(process)


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
        (['--delay', 'nan'], 'from 0 to 86400, got nan'),
        (['--rate', '1e-300'], 'from 0.01 to 1000 Hz, got 1e-300'),
        (['--stamps', 'test'], 'test: Is a directory'),
        (['--stamps', 'docs/images/stamps.txt'], 'lies in the input docs/images'),
        (['--stamps', '/dev/full'], 'gait_source: error: /dev/full: No space left on device\n'),
        (['--wait-for', 99, '--wait-timeout', 0], 'on /image within 0 s'),
        (['--ros-args', '-r', f'__ns:=/{"a" * 240}'], 'topic length should'),
    ],
)
def test_what_cannot_be_used_is_said(
    options: list[object], reason: str, capfd, monkeypatch, probe: Any
) -> None:
    monkeypatch.chdir(ROOT)
    assert main(['docs/images', *map(str, options)]) == 2
    assert reason in capfd.readouterr().err
