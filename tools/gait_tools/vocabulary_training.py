# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Learning a vocabulary by K-means, then EM of a Gaussian mixture (scikit-learn); its picture."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.config import StageConfig, parameter
from gait_segmentation.errors import ConfigError
from gait_segmentation.files import write_file
from gait_segmentation.gait_model import TemplateBank
from gait_segmentation.geometry import BodyFrame, pixel_affine, template_to_image
from gait_segmentation.paper.prior import silhouette_edges, words_of
from gait_segmentation.paper.vocabulary import FORMAT, FORMAT_VERSION, Vocabulary, VocabularyError
from gait_tools.gait_model import FIGURES, BankSpec

_COVARIANCE_FLOOR = 1e-4
_KMEANS_STARTS = 10
_MARGIN = 3
# Height that masks are brought to, so that near and far people count alike, and their least.
_HEIGHT, _LEAST_HEIGHT = 90, 16
MODEL = BankSpec(azimuths=16, phases=6, builds=','.join(FIGURES), levels=256)
"""The bank whose silhouettes the shipped vocabulary is learnt from."""

_POINTS_A_WORD = 10
_ORIENTATION_SCALE = 0.35  # how much the orientation counts against the position
_FILL, _ASPECT = 0.9, 2 / 3
"""Share of the frame's height that the body takes, and the frame's width over its height."""

_ROWS = 384
_GROUND, _BODY = 255, 232
_DIGITS = 7
_ROW = re.compile(r'\[\s+([-\d.e+,\s]+?)\s+\]')


class Silhouette(NamedTuple):
    """``mask``, (h, w) uint8 with 255 inside, and the ``body`` in its pixels."""

    mask: NDArray[np.uint8]
    body: BodyFrame


@dataclass(frozen=True)
class VocabularySpec(StageConfig):
    """How a vocabulary is learnt."""

    words: int = parameter(10, 'Number of words.', minimum=1, maximum=100)
    points: int = parameter(
        20000, 'Outline points drawn to learn from.', minimum=100, maximum=10_000_000
    )
    seed: int = parameter(1, 'Seed of all that is drawn.', minimum=0, maximum=2**31 - 1)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.points < _POINTS_A_WORD * self.words:
            raise ConfigError(
                f'points must be at least {_POINTS_A_WORD} for each of {self.words} words, '
                f'got {self.points}'
            )


def bank_silhouettes(bank: TemplateBank) -> Iterator[Silhouette]:
    """Yield every template of a bank."""
    height, width = bank.grid
    body = BodyFrame(width / 2, height / 2, bank.fill * height)
    for template in bank.templates.reshape(-1, height, width):
        yield Silhouette(template, body)


def mask_silhouettes(masks: Sequence[NDArray[np.uint8]]) -> list[Silhouette]:
    """Bring masks to one height, with the bodies in them; who is very small is left out."""
    found, tallest = [], 0
    for mask in masks:
        left, top, width, height = cv2.boundingRect(mask)
        tallest = max(tallest, height)
        if height < _LEAST_HEIGHT:
            continue
        factor = _HEIGHT / height
        kind = cv2.INTER_AREA if factor < 1 else cv2.INTER_LINEAR
        cut, size = mask[top : top + height, left : left + width], max(round(factor * width), 1)
        # A silhouette may fill its image; its outline then needs a margin to be an edge.
        wide = np.pad(cv2.resize(cut, (size, _HEIGHT), interpolation=kind), _MARGIN)
        axis = float(np.median(np.nonzero(wide > 127)[1])) + 0.5
        body = BodyFrame(axis, _MARGIN + _HEIGHT / 2, float(_HEIGHT))
        found.append(Silhouette(wide.astype(np.uint8), body))
    if not found:
        raise VocabularyError(
            f'silhouettes must be at least {_LEAST_HEIGHT} px tall, the tallest of {len(masks)} '
            f'has {tallest} px'
        )
    return found


def outline_features(
    silhouettes: Iterable[Silhouette], spec: VocabularySpec
) -> tuple[NDArray[np.float32], int]:
    """Return z of all outline points, (n, 4) float32, and the number of silhouettes."""
    # A mixture of one word, only for its frame.
    frame = Vocabulary(
        np.ones(1), np.zeros((1, 4)), np.eye(4)[None], _ORIENTATION_SCALE, _FILL, _ASPECT
    )
    parts = []
    for mask, body in silhouettes:
        points = silhouette_edges(mask, body.height)
        parts.append(
            frame.features(points.columns + 0.5, points.rows + 0.5, points.orientation, body)
        )
    features = np.concatenate(parts) if parts else np.empty((0, 4), np.float32)
    if len(features) < _POINTS_A_WORD * spec.words:
        raise VocabularyError(
            f'{spec.words} words need at least {_POINTS_A_WORD * spec.words} outline points, got '
            f'{len(features)} in {len(parts)} silhouettes'
        )
    return features, len(parts)


def learn_vocabulary(
    silhouettes: Iterable[Silhouette], spec: VocabularySpec | None = None, source: str = ''
) -> Vocabulary:
    """Learn words from the head down; the same silhouettes and specification give the same."""
    try:
        from sklearn.cluster import KMeans
        from sklearn.mixture import GaussianMixture
    except ImportError as error:
        raise VocabularyError(
            'learning a vocabulary needs scikit-learn: pip install scikit-learn'
        ) from error
    spec = spec or VocabularySpec()
    features, count = outline_features(silhouettes, spec)
    z = features.astype(np.float64)
    if len(z) > spec.points:
        chosen = np.random.default_rng(spec.seed).choice(len(z), spec.points, replace=False)
        z = z[np.sort(chosen)]
    means = KMeans(
        spec.words, init='k-means++', n_init=_KMEANS_STARTS, random_state=spec.seed
    ).fit(z)
    fitted = GaussianMixture(
        spec.words,
        covariance_type='full',
        reg_covar=_COVARIANCE_FLOOR,
        max_iter=200,
        random_state=spec.seed,
        **_start(z, means.labels_, spec.words),
    ).fit(z)
    order = np.argsort(fitted.means_[:, 1], kind='stable')
    return Vocabulary(
        fitted.weights_[order] / fitted.weights_.sum(),
        fitted.means_[order],
        fitted.covariances_[order],
        _ORIENTATION_SCALE,
        _FILL,
        _ASPECT,
        {
            'source': source,
            'silhouettes': str(count),
            'outline points': f'{len(z)} of {len(features)}',
            'method': f'K-means (k-means++, {_KMEANS_STARTS} starts), then EM, '
            f'full covariances + {_COVARIANCE_FLOOR:g} I',
            'seed': str(spec.seed),
        },
    )


def _start(
    z: NDArray[np.float64], labels: NDArray[np.int32], words: int
) -> dict[str, NDArray[np.float64]]:
    """Return the mixture that K-means found, as EM's start."""
    groups = [z[labels == word] for word in range(words)]
    floor = _COVARIANCE_FLOOR * np.eye(4)
    covariances = [np.cov(group.T, bias=True) + floor for group in groups]
    return {
        'weights_init': np.array([len(group) for group in groups]) / len(z),
        'means_init': np.array([group.mean(axis=0) for group in groups]),
        'precisions_init': np.linalg.inv(covariances),
    }


def write_vocabulary(vocabulary: Vocabulary, path: str | os.PathLike[str]) -> None:
    """Write a vocabulary to a JSON file, numbers rounded to seven decimals, one row a line."""
    words = zip(vocabulary.weights, vocabulary.means, vocabulary.covariances, strict=True)
    entries = {
        'format': FORMAT,
        'version': FORMAT_VERSION,
        'provenance': vocabulary.provenance,
        'fill': vocabulary.fill,
        'aspect': vocabulary.aspect,
        'orientation_scale': vocabulary.orientation_scale,
        'words': [
            {
                'weight': round(float(weight), _DIGITS),
                'mean': np.round(mean, _DIGITS).tolist(),
                'covariance': np.round(covariance, _DIGITS).tolist(),
            }
            for weight, mean, covariance in words
        ],
    }
    text = json.dumps(entries, indent=2)
    text = _ROW.sub(lambda row: f'[{" ".join(row[1].split())}]', text) + '\n'
    try:
        write_file(Path(path), text.encode())
    except OSError as error:
        reason = error.strerror or str(error)
        raise VocabularyError(
            f'cannot write the vocabulary {os.fspath(path)}: {reason}'
        ) from error


def draw_vocabulary(
    vocabulary: Vocabulary, silhouettes: Sequence[Silhouette]
) -> NDArray[np.uint8]:
    """Draw the words (two standard deviations, a line along the outline) beside silhouettes."""
    colours = word_colours(vocabulary.words)
    outlines = [_outline(vocabulary, silhouette, colours) for silhouette in silhouettes]
    return np.hstack([_words(vocabulary, colours), *outlines])


def word_colours(count: int) -> NDArray[np.uint8]:
    """Return the colours in which so many words are drawn, (count, 3) BGR."""
    hues = (np.arange(count) * 180 // count).astype(np.uint8)
    values = np.where(np.arange(count) % 2 == 0, 220, 150).astype(np.uint8)
    hsv = np.stack([hues, np.full(count, 230, np.uint8), values], axis=1)
    return np.asarray(cv2.cvtColor(hsv[None], cv2.COLOR_HSV2BGR)[0])


def _words(vocabulary: Vocabulary, colours: NDArray[np.uint8]) -> NDArray[np.uint8]:
    rows, columns = _ROWS, round(_ROWS * vocabulary.aspect)
    panel = np.full((rows, columns, 3), _GROUND, np.uint8)
    size = np.array([columns, rows])
    for word, colour in enumerate(colours.tolist()):
        middle = vocabulary.means[word, :2] * size
        spread = vocabulary.covariances[word, :2, :2] * np.outer(size, size)
        values, axes = np.linalg.eigh(spread)
        angle = math.degrees(math.atan2(axes[1, 1], axes[0, 1]))
        widths = 2 * np.sqrt(values[::-1])
        center = tuple(np.round(middle).astype(int).tolist())
        lengths = tuple(np.round(widths).astype(int).tolist())
        cv2.ellipse(panel, center, lengths, angle, 0, 360, colour, 1, cv2.LINE_AA)
        theta = math.atan2(vocabulary.means[word, 3], vocabulary.means[word, 2]) / 2
        along = 14 * np.array([-math.sin(theta), math.cos(theta)])
        ends = [tuple(np.round(middle + s * along).astype(int).tolist()) for s in (-1, 1)]
        cv2.line(panel, ends[0], ends[1], colour, 3, cv2.LINE_AA)
    return panel


def _outline(
    vocabulary: Vocabulary, silhouette: Silhouette, colours: NDArray[np.uint8]
) -> NDArray[np.uint8]:
    rows, columns = _ROWS, round(_ROWS * vocabulary.aspect)
    body = BodyFrame(columns / 2, rows / 2, vocabulary.fill * rows)
    to_mask = pixel_affine(template_to_image(silhouette.body, rows, columns, body.height))
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    mask = cv2.warpAffine(silhouette.mask, to_mask, (columns, rows), flags=flags)
    points = silhouette_edges(mask, body.height)
    panel = np.full((rows, columns, 3), _GROUND, np.uint8)
    panel[mask > 127] = _BODY
    places = points.columns.tolist(), points.rows.tolist()
    for *place, word in zip(*places, words_of(vocabulary, points, body), strict=True):
        cv2.circle(panel, place, 1, colours[word].tolist(), -1)
    return panel
