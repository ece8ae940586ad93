# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gait_segmentation.geometry import BodyFrame
from gait_segmentation.paper.vocabulary import Vocabulary, VocabularyError, default_vocabulary
from gait_tools.vocabulary_training import write_vocabulary

BODY = BodyFrame(50.0, 80.0, 90.0)


def two_words() -> Vocabulary:
    return Vocabulary(
        np.array([0.25, 0.75]),
        np.array([[0.5, 0.2, 0.35, 0.0], [0.5, 0.8, -0.35, 0.0]]),
        np.array([np.diag([0.01, 0.02, 0.03, 0.04]), 0.02 * np.eye(4)]),
        0.35,
        0.9,
        2 / 3,
        {'source': 'a test'},
    )


def test_the_shipped_vocabulary_has_ten_words_of_several_hundred_silhouettes() -> None:
    vocabulary = default_vocabulary()
    assert vocabulary.words == 10
    assert int(vocabulary.provenance['silhouettes']) >= 400
    assert (np.diff(vocabulary.means[:, 1]) >= 0).all()


def test_posteriors_are_those_of_the_mixture() -> None:
    vocabulary = two_words()
    rng = np.random.default_rng(3)
    x, y, orientation = (rng.uniform(0, high, 40) for high in (100, 160, 7))
    z = vocabulary.features(x, y, orientation, BODY)
    shares = []
    for weight, mean, covariance in zip(
        vocabulary.weights, vocabulary.means, vocabulary.covariances, strict=True
    ):
        away = z - mean
        exponent = -0.5 * np.einsum('ni,ij,nj->n', away, np.linalg.inv(covariance), away)
        shares.append(weight * np.exp(exponent) / math.sqrt(np.linalg.det(covariance)))
    expected = np.array(shares).T
    expected /= expected.sum(axis=1, keepdims=True)
    np.testing.assert_allclose(vocabulary.posteriors(z), expected, rtol=1e-3, atol=1e-5)
    assert (vocabulary.nearest(z) == expected.argmax(axis=1)).all()


@pytest.mark.parametrize(
    ('x', 'y', 'orientation', 'lean', 'expected'),
    [
        # The frame of a body 90 px tall is 100 px high and 66.7 wide; its top left is (16.7, 30).
        (50, 30, 2, 0, [0.5, 0, -0.35, 0]),
        (150 / 9, 105, 1, 0, [0, 0.75, 0, 0.35]),
        # The head leans to the right by a quarter turn, and so does the outline above it.
        (100, 80, 0, 2, [0.5, 0, -0.35, 0]),
    ],
)
def test_features_are_the_place_in_the_frame_and_the_doubled_orientation(
    x: float, y: float, orientation: int, lean: int, expected: list[float]
) -> None:
    body = BodyFrame(50.0, 80.0, 90.0, lean * math.pi / 4)
    given = (np.array([float(each)]) for each in (x, y, orientation * math.pi / 4))
    np.testing.assert_allclose(two_words().features(*given, body), [expected], atol=1e-6)


def test_what_is_saved_is_loaded(tmp_path: Path) -> None:
    path = tmp_path / 'words.json'
    write_vocabulary(two_words(), path)
    loaded = Vocabulary.load(path)
    np.testing.assert_allclose(loaded.covariances, two_words().covariances)
    np.testing.assert_allclose(loaded.means, two_words().means)
    assert loaded.provenance == {'source': 'a test'}
    assert (loaded.fill, loaded.orientation_scale) == (0.9, 0.35)
    assert max(len(line) for line in path.read_text().splitlines()) < 99


def change(value: Any, *keys: str | int) -> Callable[[Any], None]:
    def apply(entries: Any) -> None:
        for key in keys[:-1]:
            entries = entries[key]
        entries[keys[-1]] = value

    return apply


@pytest.mark.parametrize(
    ('damage', 'message'),
    [
        (change('another', 'format'), 'format must be'),
        (change(7, 'version'), 'version must be 1, got 7'),
        (change(None, 'fill'), 'no complete vocabulary: TypeError'),
        (lambda entries: entries.pop('fill'), r"no complete vocabulary: KeyError\('fill'\)"),
        (change([], 'words'), 'at least one word'),
        (change(1.5, 'fill'), r'fill must be in \(0, 1\], got 1.5'),
        (change(0, 'orientation_scale'), 'orientation_scale must be'),
        (change(-0.25, 'words', 0, 'weight'), 'weights must be positive'),
        (change(0.5, 'words', 0, 'weight'), 'add up to 1'),
        (change([0.5, 0.2, float('nan'), 0.0], 'words', 0, 'mean'), 'means must be finite'),
        (
            change(np.ones((4, 4)).tolist(), 'words', 0, 'covariance'),
            'covariance of word 0 must be',
        ),
        (change(np.triu(np.ones((4, 4))).tolist(), 'words', 0, 'covariance'), 'symmetric'),
    ],
)
def test_a_damaged_file_is_refused(
    tmp_path: Path, damage: Callable[[dict[str, Any]], None], message: str
) -> None:
    path = tmp_path / 'words.json'
    write_vocabulary(two_words(), path)
    entries = json.loads(path.read_text())
    damage(entries)
    path.write_text(json.dumps(entries))
    with pytest.raises(VocabularyError, match=message) as caught:
        Vocabulary.load(path)
    assert str(path) in str(caught.value)


def test_files_that_are_none_are_refused(tmp_path: Path) -> None:
    with pytest.raises(VocabularyError, match='cannot read the vocabulary'):
        Vocabulary.load(tmp_path / 'missing.json')
    path = tmp_path / 'words.json'
    path.write_text('{')
    with pytest.raises(VocabularyError, match='is not a JSON file'):
        Vocabulary.load(path)
    path.write_bytes(b'\xff\xfe\x00')
    with pytest.raises(VocabularyError, match='is not a JSON file'):
        Vocabulary.load(path)
    with pytest.raises(VocabularyError, match='cannot write'):
        write_vocabulary(two_words(), tmp_path / 'missing' / 'words.json')
