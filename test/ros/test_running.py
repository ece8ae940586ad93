# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The exit code of a node, and its command line; signals are in test_ending.py."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
import pytest
import rclpy
from rclpy.impl.implementation_singleton import rclpy_implementation

from gait_segmentation.ending import Ending
from gait_segmentation.errors import GaitSegmentationError
from gait_segmentation.nodes.matcher_node import MatcherNode
from gait_segmentation.nodes.segmenter_node import SegmenterNode
from gait_segmentation.ros.running import run_node, silence_opencv


class _Node:
    handle = None
    subscriptions = timers = clients = services = guards = waitables = ()

    def __init__(self, start: Callable[[], bool]) -> None:
        self._start = start
        self.closed = 0
        self.executor = None

    def start(self) -> bool:
        return self._start()

    def close(self) -> None:
        self.closed += 1

    def destroy_node(self) -> None:
        self.closed += 1

    def create_timer(self, *_: Any, **__: Any) -> None:
        pass


pytestmark = pytest.mark.usefixtures('signal_handlers')


def _run(start: Callable[[], bool]) -> int:
    node: Any = _Node(start)
    try:
        return run_node(lambda: node, [])
    finally:
        assert node.closed == 2
        assert not rclpy.ok()


def _failing() -> bool:
    raise RuntimeError('context is not valid')


def test_a_start_that_fails_is_an_error() -> None:
    assert _run(lambda: False) == 1
    with pytest.raises(RuntimeError, match='not valid'):
        _run(_failing)


def test_a_node_that_hangs_while_it_is_made_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    beats: list[int] = []
    monkeypatch.setattr(Ending, 'beat', lambda _: beats.append(1))

    def made() -> Any:
        # Without a first beat nobody would notice that no other comes.
        assert beats
        raise GaitSegmentationError('made')

    assert run_node(made, []) == 1
    assert beats == [1]


@pytest.mark.parametrize(('words', 'code'), [(['--help'], 0), (['--rate', '3'], 2)])
def test_the_usage_is_shown_instead_of_a_start(words: list[str], code: int, capsys) -> None:
    with pytest.raises(SystemExit) as end:
        run_node(lambda: pytest.fail('started'), ['node', *words, '--ros-args', '-p', 'a:=1'])
    assert end.value.code == code
    said = capsys.readouterr()
    assert '--params-file FILE' in said.out + said.err
    assert ('exit code: 0' in said.out) == (code == 0)


@pytest.mark.parametrize(('node', 'sees'), [(MatcherNode, False), (SegmenterNode, True)])
def test_the_usage_remaps_the_camera_where_there_is_one(node: Any, sees: bool, capsys) -> None:
    with pytest.raises(SystemExit):
        run_node(node, ['node', '--help'])
    assert ('-r image:=/camera' in capsys.readouterr().out) == sees


def test_ros_arguments_that_make_no_sense_are_an_error(capsys) -> None:
    assert run_node(lambda: pytest.fail('started'), ['node', '--ros-args', '-p', 'a']) == 2
    assert 'Error' in capsys.readouterr().err


def test_a_node_that_ros_refuses_is_an_error_without_a_traceback(capsys) -> None:
    """As it does all nodes where they are to be secure and the DDS cannot be."""

    def make() -> Any:
        raise rclpy_implementation.RCLError('no security libraries')

    assert run_node(make, ['/bin/gait_node']) == 1
    assert capsys.readouterr().err == 'gait_node: error: no security libraries\n'


def test_opencv_prints_nothing_of_what_it_cannot_decode(capfd) -> None:
    tiff = cv2.imencode('.tiff', np.zeros((32, 32, 3), np.uint8))[1]
    level = getattr(cv2, 'getLogLevel', None) or cv2.utils.logging.getLogLevel
    before = level()
    silence_opencv()
    try:
        assert cv2.imdecode(tiff[: len(tiff) // 2], cv2.IMREAD_COLOR) is None
    finally:
        (getattr(cv2, 'setLogLevel', None) or cv2.utils.logging.setLogLevel)(before)
    assert capfd.readouterr() == ('', '')
