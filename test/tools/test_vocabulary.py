# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import importlib.util
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from gait_segmentation.errors import ConfigError
from gait_segmentation.paper.vocabulary import Vocabulary, VocabularyError
from gait_tools.cli import bank as command
from gait_tools.cli.bank import main
from gait_tools.gait_model import BankSpec, build_bank, render_silhouette
from gait_tools.vocabulary_training import (
    Silhouette,
    VocabularySpec,
    bank_silhouettes,
    learn_vocabulary,
    mask_silhouettes,
    outline_features,
)

needs_sklearn = pytest.mark.skipif(
    importlib.util.find_spec('sklearn') is None, reason='scikit-learn is not installed'
)
SPEC = VocabularySpec(words=4, points=1500)


@pytest.fixture(scope='module')
def silhouettes() -> list[Silhouette]:
    return list(bank_silhouettes(build_bank(BankSpec(azimuths=4, phases=4, levels=256))))


def test_a_square_has_its_outline_at_its_place() -> None:
    mask = np.zeros((120, 100), np.uint8)
    mask[10:100, 35:65] = 255
    (silhouette,) = mask_silhouettes([mask])
    assert silhouette.body.height == 90
    z, count = outline_features([silhouette], SPEC)
    assert count == 1
    # In the frame of 100 x 66.7 px the square is 0.9 high and 0.45 wide about the middle; of the
    # two pixels at a clear edge, the outline has the upper or left one.
    half = np.array([0.5 / (200 / 3), 0.5 / 100])
    np.testing.assert_allclose(z[:, :2].min(axis=0), (0.275, 0.05) - half, atol=1e-4)
    np.testing.assert_allclose(z[:, :2].max(axis=0), (0.725, 0.95) - half, atol=1e-4)
    side = np.abs(z[:, 1] - 0.5) < 0.3
    np.testing.assert_allclose(z[side, 2], 0.35, atol=1e-4)


def test_what_is_too_little_is_refused(silhouettes: list[Silhouette]) -> None:
    small = np.zeros((40, 40), np.uint8)
    small[10:20, 10:15] = 255
    with pytest.raises(VocabularyError, match='at least 16 px tall, the tallest of 2 has 10 px'):
        mask_silhouettes([small, small[:, 12:]])
    large = np.full((16, 5), 255, np.uint8)
    assert len(mask_silhouettes([small, large])) == 1
    with pytest.raises(VocabularyError, match='at least 40 outline points, got 0'):
        outline_features([], SPEC)
    with pytest.raises(ConfigError, match='at least 10 for each of 100 words, got 999'):
        VocabularySpec(words=100, points=999)


def test_a_missing_scikit_learn_is_named(
    monkeypatch: pytest.MonkeyPatch, silhouettes: list[Silhouette]
) -> None:
    monkeypatch.setitem(sys.modules, 'sklearn.cluster', None)
    with pytest.raises(VocabularyError, match='pip install scikit-learn'):
        learn_vocabulary(silhouettes, SPEC)


QUICK = ['--words', '3', '--points', '500']


def run(*arguments: str) -> None:
    assert main(['vocabulary', *arguments]) == 0


@needs_sklearn
def test_words_of_a_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder, output, picture = (tmp_path / name for name in ('walk', 'words.json', 'words.png'))
    folder.mkdir()
    for index in range(6):
        cv2.imwrite(str(folder / f'{index}.png'), render_silhouette(index / 6, 0.0, 80))
    run(str(output), '--from', str(folder), '--picture', str(picture), *QUICK)
    assert '3 words from 6 silhouettes (500 of ' in capsys.readouterr().out
    made = Vocabulary.load(output)
    assert made.words == 3
    assert made.provenance['source'] == 'folders walk'
    drawn = cv2.imread(str(picture))
    assert drawn.shape == (384, 7 * 256, 3)
    assert len(np.unique(drawn.reshape(-1, 3), axis=0)) > 4
    # The words part the outline.
    masks = [cv2.imread(str(path), 0) for path in folder.iterdir()]
    z, _ = outline_features(mask_silhouettes(masks), VocabularySpec(words=3, points=500))
    assert np.bincount(made.nearest(z), minlength=3).min() > 0.03 * len(z)
    run(str(tmp_path / 'again.json'), '--from', str(folder), *QUICK)
    assert '3 words from 6 silhouettes' in capsys.readouterr().out
    assert (tmp_path / 'again.json').read_bytes() == output.read_bytes()


def test_the_model_is_the_default(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen = []

    def learn(silhouettes: list, spec: object, source: str) -> Vocabulary:
        seen.append((len(silhouettes), source))
        about = {'silhouettes': '1', 'outline points': '1'}
        return Vocabulary(np.ones(1), np.zeros((1, 4)), np.eye(4)[None], 0.35, 0.9, 0.67, about)

    monkeypatch.setattr(command, 'learn_vocabulary', learn)
    run(str(tmp_path / 'words.json'))
    assert seen[0][0] >= 400
    assert seen[0][1] == 'gait model'
    assert Vocabulary.load(tmp_path / 'words.json').words == 1
