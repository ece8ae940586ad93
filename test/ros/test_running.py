# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The exit code of a node and its command line."""

from __future__ import annotations

import contextlib
import importlib

import cv2
import numpy as np
import pytest

from gait_segmentation.nodes.matcher_node import MatcherNode
from gait_segmentation.ros.running import run_node, silence_opencv


@pytest.mark.parametrize(('words', 'code'), [(['--help'], 0), (['--rate', '3'], 2)])
def test_the_usage_is_shown_instead_of_a_start(words: list[str], code: int, capsys) -> None:
    with pytest.raises(SystemExit) as end:
        run_node(MatcherNode, ['node', *words, '--ros-args', '-p', 'a:=1'])
    assert end.value.code == code
    said = capsys.readouterr()
    assert '--params-file FILE' in said.out + said.err
    assert ('exit code: 0' in said.out) == (code == 0)


@pytest.mark.parametrize('name', ['localizer', 'matcher', 'pipeline', 'segmenter', 'tracker'])
def test_each_node_has_a_command(name: str, capsys) -> None:
    command = importlib.import_module(f'gait_segmentation.nodes.{name}_node').main
    with contextlib.suppress(Exception, SystemExit):
        command(['node', '--help'])
    assert f'gait_{name}' in capsys.readouterr().out


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
