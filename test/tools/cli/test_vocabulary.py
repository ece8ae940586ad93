# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import argparse
import importlib.util
from pathlib import Path

import cv2
import numpy as np
import pytest

from gait_segmentation.errors import GaitSegmentationError
from gait_segmentation.paper.vocabulary import Vocabulary
from gait_tools.cli import vocabulary as command
from gait_tools.gait_model import render_silhouette

needs_sklearn = pytest.mark.skipif(
    importlib.util.find_spec('sklearn') is None, reason='scikit-learn is not installed'
)
QUICK = ['--words', '3', '--points', '500']


def run(*arguments: str) -> None:
    parser = argparse.ArgumentParser()
    command.add_parser(parser.add_subparsers(dest='command'))
    command.run(parser.parse_args(['vocabulary', *arguments]))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    made = tmp_path / 'walk'
    made.mkdir()
    for index in range(6):
        mask = render_silhouette(index / 6, 0.0, 80)
        cv2.imwrite(str(made / f'{index}.png'), mask)
    return made


@needs_sklearn
def test_words_of_a_folder(
    tmp_path: Path, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output, picture = tmp_path / 'words.json', tmp_path / 'words.png'
    run(str(output), '--from', str(folder), '--picture', str(picture), *QUICK)
    assert '3 words from 6 silhouettes (500 of ' in capsys.readouterr().out
    made = Vocabulary.load(output)
    assert made.words == 3
    assert made.provenance['source'] == 'folders walk'
    assert cv2.imread(str(picture)).shape == (384, 7 * 256, 3)
    run(str(tmp_path / 'again.json'), '--from', str(folder), '--quiet', *QUICK)
    assert capsys.readouterr().out == ''
    assert (tmp_path / 'again.json').read_bytes() == output.read_bytes()


def test_the_model_is_the_default(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen = []

    def learn(silhouettes: list, spec: object, source: str) -> Vocabulary:
        seen.append((len(silhouettes), source))
        return Vocabulary(np.ones(1), np.zeros((1, 4)), np.eye(4)[None], 0.35, 0.9, 0.67)

    monkeypatch.setattr(command, 'learn_vocabulary', learn)
    run(str(tmp_path / 'words.json'), '--quiet')
    assert seen[0][0] >= 400
    assert seen[0][1] == 'gait model'
    assert Vocabulary.load(tmp_path / 'words.json').words == 1


@pytest.mark.parametrize(
    ('output', 'given', 'reason'),
    [
        ('missing/words.json', [], 'is not a folder'),
        ('words.json', ['--picture', 'missing/words.png'], 'is not a folder'),
        ('words.json', ['--words', '0'], 'words must be'),
        ('words.json', ['--from', 'missing'], 'is not a folder of silhouettes'),
        ('words.json', ['--from', 'far'], 'at least 16 px tall'),
    ],
)
def test_bad_input_is_refused_before_learning(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, output: str, given: list[str], reason: str
) -> None:
    monkeypatch.chdir(tmp_path)
    Path('far').mkdir()
    cv2.imwrite('far/1.png', np.pad(np.full((9, 3), 255, np.uint8), 5))
    with pytest.raises(GaitSegmentationError, match=reason):
        run(output, *given)
    assert not Path(output).exists()
