# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The exit code of a node that is stopped while it starts."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import rclpy

from gait_segmentation.ros.running import Patience, run_node


class _Node:
    def __init__(self, start: Callable[[], bool]) -> None:
        self.start = start
        self.closed = 0

    def close(self) -> None:
        self.closed += 1

    def destroy_node(self) -> None:
        self.closed += 1


@pytest.fixture(autouse=True)
def signals() -> Iterator[None]:
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.getsignal(number) for number in numbers]
    yield
    for number, handler in zip(numbers, before, strict=True):
        signal.signal(number, handler)


def _run(start: Callable[[], bool]) -> int:
    node: Any = _Node(start)
    try:
        return run_node(lambda: node, [])
    finally:
        assert node.closed == 2
        assert not rclpy.ok()


def _failing() -> bool:
    raise RuntimeError('context is not valid')


def _shut(result: Callable[[], bool]) -> Callable[[], bool]:
    def start() -> bool:
        rclpy.shutdown()  # What the handler of SIGINT and SIGTERM does.
        return result()

    return start


def test_a_start_that_fails_is_an_error() -> None:
    assert _run(lambda: False) == 1
    with pytest.raises(RuntimeError, match='not valid'):
        _run(_failing)


def test_a_start_that_a_signal_breaks_off_is_none() -> None:
    assert _run(_shut(lambda: False)) == 0
    assert _run(_shut(_failing)) == 0
    # Too late to be noticed by the start.
    assert _run(_shut(lambda: True)) == 0


@pytest.mark.parametrize(('words', 'code'), [(['--help'], 0), (['--rate', '3'], 2)])
def test_the_usage_is_shown_instead_of_a_start(words: list[str], code: int, capsys) -> None:
    with pytest.raises(SystemExit) as end:
        run_node(lambda: pytest.fail('started'), ['node', *words, '--ros-args', '-p', 'a:=1'])
    assert end.value.code == code
    said = capsys.readouterr()
    assert '--params-file FILE' in said.out + said.err


def test_ros_arguments_that_make_no_sense_are_an_error(capsys) -> None:
    assert run_node(lambda: pytest.fail('started'), ['node', '--ros-args', '-p', 'a']) == 2
    assert 'Error' in capsys.readouterr().err


def test_only_a_second_ctrl_c_breaks_off_what_runs() -> None:
    signal.signal(signal.SIGINT, Patience())
    signal.raise_signal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_one_signal_breaks_off_a_start(number: signal.Signals) -> None:
    def long() -> bool:
        signal.raise_signal(number)
        pytest.fail('it went on')

    assert _run(long) == 0


def test_a_start_after_a_signal_is_none() -> None:
    def make() -> Any:
        signal.raise_signal(signal.SIGINT)
        return _Node(lambda: pytest.fail('started'))

    assert run_node(make, []) == 0


def test_nothing_is_broken_off_at_the_end() -> None:
    patience = Patience()
    patience.ended = True
    signal.signal(signal.SIGINT, patience)
    for _ in range(3):
        signal.raise_signal(signal.SIGINT)


def test_any_number_of_signals_ends_a_node_in_order() -> None:
    script = """
import sys
from rclpy.node import Node
from gait_segmentation.ros.running import run_node
class Quiet(Node):
    def __init__(self):
        super().__init__('quiet')
    def start(self):
        print('started', flush=True)
        return True
    def close(self):
        pass
sys.exit(run_node(Quiet, ['quiet']))
"""
    for pause_s in (0.0, 0.0001, 0.001, 0.005):
        with subprocess.Popen(
            [sys.executable, '-c', script],
            cwd=Path(__file__).resolve().parents[2],
            env={**os.environ, 'ROS_AUTOMATIC_DISCOVERY_RANGE': 'OFF'},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        ) as process:
            assert process.stdout is not None
            assert process.stdout.readline() == 'started\n'
            while process.poll() is None:
                process.send_signal(signal.SIGINT)
                time.sleep(pause_s)
            # Python itself may say of the last one that it came while its handler was changed.
            assert 'KeyboardInterrupt' not in process.stdout.read()
            assert process.returncode == 0
