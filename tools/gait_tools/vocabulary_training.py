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
from matplotlib import colormaps
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse
from numpy.typing import NDArray

from gait_segmentation.config import StageConfig, parameter
from gait_segmentation.errors import ConfigError
from gait_segmentation.files import write_file
from gait_segmentation.gait_model import TemplateBank
from gait_segmentation.geometry import BodyFrame
from gait_segmentation.paper.prior import silhouette_edges, words_of
from gait_segmentation.paper.vocabulary import (
    WORDS_FORMAT,
    WORDS_VERSION,
    Vocabulary,
    VocabularyError,
)
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

_BODY = 232  # grey level of silhouettes in a picture
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
        'format': WORDS_FORMAT,
        'version': WORDS_VERSION,
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


def draw_vocabulary(vocabulary: Vocabulary, silhouettes: Sequence[Silhouette]) -> Figure:
    """Draw the words (two standard deviations, a line along the outline) beside silhouettes."""
    colours, aspect = word_colours(vocabulary.words), vocabulary.aspect
    figure = Figure(((len(silhouettes) + 1) * 4 * aspect, 4), dpi=96, layout='constrained')
    words, *others = figure.subplots(1, len(silhouettes) + 1)
    for mean, covariance, colour in zip(
        vocabulary.means, vocabulary.covariances, colours, strict=True
    ):
        lengths, axes = np.linalg.eigh(covariance[:2, :2] * np.outer((aspect, 1), (aspect, 1)))
        angle = math.degrees(math.atan2(axes[1, 1], axes[0, 1]))
        middle, (height, width) = mean[:2] * (aspect, 1), 4 * np.sqrt(lengths)
        words.add_patch(Ellipse(middle, width, height, angle=angle, fill=False, color=colour))
        theta = math.atan2(mean[3], mean[2]) / 2
        along = 0.04 * np.array([-math.sin(theta), math.cos(theta)])
        words.plot(*np.stack([middle - along, middle + along], 1), color=colour, linewidth=3)
    words.set(xlim=(0, aspect), ylim=(1, 0), aspect='equal')
    for axes, (mask, body) in zip(others, silhouettes, strict=True):
        points = silhouette_edges(mask, body.height)
        axes.imshow(np.where(mask > 127, _BODY, 255), cmap='gray', vmin=0, vmax=255)
        found = colours[words_of(vocabulary, points, body)]
        axes.scatter(points.columns, points.rows, s=4, color=found)
    for axes in (words, *others):
        axes.axis('off')
    return figure


def word_colours(count: int) -> NDArray[np.float64]:
    """Return the colours in which so many words are drawn, (count, 4) RGBA from 0 to 1."""
    return np.asarray(colormaps['hsv'](np.arange(count) / count))
