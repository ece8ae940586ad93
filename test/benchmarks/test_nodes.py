# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of what the nodes take, and the network beside them; nothing is timed here."""

from __future__ import annotations

import argparse
import json
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from gait_segmentation.geometry import Box
from test.networks import box_network

pytest.importorskip('rclpy', reason='needs ROS 2: rclpy cannot be imported')

from benchmarks import nodes
from gait_segmentation.cli.tool import run_tool


@pytest.fixture(autouse=True)
def few_frames(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Have films of a few frames, and leave OpenCV its threads."""
    monkeypatch.setattr(nodes, 'STEPS', 3)
    threads = cv2.getNumThreads()
    yield
    cv2.setNumThreads(threads)


@pytest.fixture
def measured(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Any, ...]]:
    """Have figures without nodes; what was to be measured is in the list."""
    asked: list[tuple[Any, ...]] = []

    def measure(
        style: str, film: Path, slots: int, box: Box | None, _: argparse.Namespace
    ) -> dict[str, float]:
        shown = cv2.imread(str(film / '000000.bmp'))
        asked.append((style, shown.shape, slots, box is not None))
        return {each: float(len(asked)) for each in (*nodes.COLUMNS, 'p99')}

    monkeypatch.setattr(nodes, 'measure', measure)
    return asked


def call(monkeypatch: pytest.MonkeyPatch, *arguments: object) -> int:
    monkeypatch.setattr(sys, 'argv', ['nodes.py', *map(str, arguments)])
    return run_tool('nodes.py', nodes.main)


def test_walkers_go_to_and_fro(tmp_path: Path) -> None:
    seen = []
    for walkers in (1, 2):
        box = nodes.write_walkers(tmp_path / str(walkers), (96, 64), walkers)
        assert box.height == pytest.approx(nodes.PERSON * 64, abs=3)
        films = sorted((tmp_path / str(walkers)).iterdir())
        first, middle, last, again = (cv2.imread(str(each)) for each in films)
        assert first.shape == (64, 96, 3)
        np.testing.assert_array_equal(middle, again)
        assert (first != last).any()
        seen.append(first)
    assert (seen[0] != seen[1]).any()


def test_every_film_and_style_has_a_row(
    measured: list[tuple[Any, ...]],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    written = tmp_path / 'figures.json'
    options = ['--sizes', '96x64', '64x64', '--walkers', 1, 4, '--json', written]
    assert call(monkeypatch, *options) == 0
    assert measured == [
        (style, shape, walkers, walkers == 1)
        for shape in ((64, 96, 3), (64, 64, 3))
        for walkers in (1, 4)
        for style in ('split', 'single')
    ]
    heading, *rows = capsys.readouterr().out.splitlines()
    assert heading.split() == list(nodes.COLUMNS)
    names = ['96x64', '96x64, 4 walkers', '64x64', '64x64, 4 walkers']
    for number, row in enumerate(rows):
        about = f'{names[number // 2]:20s} {("split", "single")[number % 2]:6s}'
        assert row.startswith(about)
        assert row[len(about) :].split() == [str(number + 1)] * len(nodes.COLUMNS)
        # The columns are below their names.
        assert len(row) == len(heading)
    report = json.loads(written.read_text())
    assert list(report) == names
    assert report['64x64']['single']['p99'] == 6


@pytest.mark.parametrize(('walkers', 'bars'), [(1, 4), (4, 0)])
def test_only_the_film_of_one_has_bars(
    walkers: int,
    bars: int,
    measured: list[tuple[Any, ...]],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    # What is measured is 1, of which one frame lost is too many.
    assert call(monkeypatch, '--walkers', walkers, '--styles', 'split') == bool(bars)
    said = capsys.readouterr().out.splitlines()[2:]
    assert [each.split()[0] for each in said] == ['ok', 'MISS', 'ok', 'ok'][:bars]


def test_a_network_is_timed_on_each_film(
    measured: list[tuple[Any, ...]],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    # As YOLO-seg: boxes with what they take of the prototypes, which are the second output.
    network = box_network(tmp_path, np.zeros((1, 116, 126)), more=('prototypes',))
    options = ['--walkers', 1, 2, '--styles', 'single', '--sizes', '96x64', '--onnx', network]
    assert call(monkeypatch, *options) == 0
    said = capsys.readouterr().out
    told = re.findall(r'(?m)^(.*?) +network alone: \d+\.\d ms per frame$', said)
    assert told == ['96x64', '96x64, 2 walkers']
    assert len(measured) == 2


@pytest.mark.parametrize('content', [None, b'no network'])
def test_a_network_that_cannot_be_read_is_told_at_once(
    content: bytes | None,
    measured: list[tuple[Any, ...]],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = tmp_path / 'yolo.onnx'
    if content is not None:
        path.write_bytes(content)
    assert call(monkeypatch, '--onnx', path) == 2
    assert f'nodes.py: error: {path} cannot be loaded: ' in capsys.readouterr().err
    assert not measured
