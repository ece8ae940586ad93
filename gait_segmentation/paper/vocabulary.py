# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The vocabulary of the oriented shape prior: words over position and orientation of outline points.

A point of a silhouette's outline is z = (x / W, y / H, c cos 2 theta, c sin 2 theta): its place
in the frame of a template and the undirected orientation of its gradient, doubled so that 0 and
pi are the same.  A word is a Gaussian over z; the vocabulary is their mixture.
"""

from __future__ import annotations

import functools
import json
import math
import os
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import GaitSegmentationError
from gait_segmentation.geometry import BodyFrame
from gait_segmentation.kernels import kernel

WORDS_FORMAT = 'gait_segmentation vocabulary'
WORDS_VERSION = 1


class VocabularyError(GaitSegmentationError):
    """A vocabulary is malformed, of another version, or cannot be read, written or learnt."""


@dataclass(frozen=True)
class Vocabulary:
    """
    A mixture of K Gaussians over (x / W, y / H, c cos 2 theta, c sin 2 theta).

    :param weights: (K,) float64 > 0, shares of the words, adding up to 1.
    :param means: (K, 4) float64.
    :param covariances: (K, 4, 4) float64, symmetric and positive definite.
    :param orientation_scale: c, how much orientation counts against position, > 0.
    :param fill: share of the frame's height H that the body takes, in (0, 1].
    :param aspect: W / H of the frame, > 0.
    :param provenance: how it was made, name -> text.
    :raises VocabularyError: if shapes or values do not fit.
    """

    weights: NDArray[np.float64]
    means: NDArray[np.float64]
    covariances: NDArray[np.float64]
    orientation_scale: float
    fill: float
    aspect: float
    provenance: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        words = len(self.weights)
        if words == 0:
            raise VocabularyError('a vocabulary must have at least one word, got none')
        for name, array, shape in (
            ('weights', self.weights, (words,)),
            ('means', self.means, (words, 4)),
            ('covariances', self.covariances, (words, 4, 4)),
        ):
            if array.shape != shape:
                raise VocabularyError(f'{name} must have the shape {shape}, got {array.shape}')
            if not np.isfinite(array).all():
                raise VocabularyError(f'{name} must be finite numbers, got {array.tolist()}')
        if (self.weights <= 0).any() or abs(self.weights.sum() - 1) > 1e-3:
            raise VocabularyError(
                f'weights must be positive and add up to 1, got {self.weights.tolist()}'
            )
        for index, matrix in enumerate(self.covariances):
            symmetric = np.allclose(matrix, matrix.T, rtol=1e-4, atol=1e-9)
            if not symmetric or np.linalg.eigvalsh(matrix)[0] <= 1e-9:
                raise VocabularyError(
                    f'covariance of word {index} must be symmetric and positive definite, got '
                    f'{matrix.tolist()}'
                )
        for name, value, most in (
            ('orientation_scale', self.orientation_scale, math.inf),
            ('fill', self.fill, 1.0),
            ('aspect', self.aspect, math.inf),
        ):
            if not 0 < value <= most or not math.isfinite(value):
                raise VocabularyError(f'{name} must be in (0, {most:g}], got {value!r}')

    @functools.cached_property
    def _density(self) -> tuple[NDArray[np.float32], ...]:
        """Whitening (K, 4, 4), lower triangular, its offset (K, 4) and logs of the factors."""
        whitening = np.linalg.inv(np.linalg.cholesky(self.covariances))
        offset = np.einsum('kij,kj->ki', whitening, self.means)
        diagonal = np.einsum('kii->ki', whitening)
        factors = np.log(self.weights) + np.log(diagonal).sum(axis=1)
        return tuple(each.astype(np.float32) for each in (whitening, offset, factors))

    @property
    def words(self) -> int:
        """Return K, the number of words."""
        return len(self.weights)

    def features(
        self,
        x: NDArray[np.floating],
        y: NDArray[np.floating],
        orientation: NDArray[np.floating],
        body: BodyFrame,
    ) -> NDArray[np.float32]:
        """
        Return z of points of an image.

        :param x: (n,) positions to the right in pixels; the first pixel's centre is 0.5.
        :param y: (n,) positions downwards.
        :param orientation: (n,) orientation of the gradient in radians, modulo pi.
        :param body: the body in the same image.
        :returns: (n, 4) float32.
        """
        cos, sin = math.cos(body.angle), math.sin(body.angle)
        height = body.height / self.fill
        dx, dy = x - body.center_x, y - body.center_y
        doubled = 2 * (orientation - body.angle)
        z = np.empty((len(x), 4), np.float32)
        z[:, 0] = 0.5 + (cos * dx + sin * dy) / (self.aspect * height)
        z[:, 1] = 0.5 + (cos * dy - sin * dx) / height
        z[:, 2] = self.orientation_scale * np.cos(doubled)
        z[:, 3] = self.orientation_scale * np.sin(doubled)
        return z

    def posteriors(self, features: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return how probable words are, (n, K) float32, by (n, 4) float32 of :meth:`features`."""
        logs = self._log_densities(features)
        logs -= logs.max(axis=1, keepdims=True)
        np.exp(logs, out=logs)
        logs /= logs.sum(axis=1, keepdims=True)
        return logs

    def nearest(self, features: NDArray[np.float32]) -> NDArray[np.int64]:
        """Return the most probable word of each point, (n,), for (n, 4) float32 features."""
        return np.asarray(self._log_densities(features).argmax(axis=1))

    def _log_densities(self, features: NDArray[np.float32]) -> NDArray[np.float32]:
        logs = np.empty((len(features), self.words), np.float32)
        _fill_log_densities(features, *self._density, logs)
        return logs

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Vocabulary:
        """
        Read a vocabulary from a JSON file made by ``gait_bank vocabulary``.

        :raises VocabularyError: if the file is missing, damaged or of another version.
        """
        name = os.fspath(path)
        try:
            entries = json.loads(Path(path).read_text(encoding='utf-8'))
        except OSError as error:
            reason = error.strerror or str(error)
            raise VocabularyError(f'cannot read the vocabulary {name}: {reason}') from error
        except (ValueError, RecursionError) as error:
            raise VocabularyError(f'{name} is not a JSON file: {error}') from error
        if not isinstance(entries, dict) or entries.get('format') != WORDS_FORMAT:
            raise VocabularyError(f"{name}: format must be '{WORDS_FORMAT}', another kind of file")
        if entries.get('version') != WORDS_VERSION:
            raise VocabularyError(
                f'{name}: version must be {WORDS_VERSION}, got {entries.get("version")!r}; make '
                'it again with gait_bank vocabulary'
            )
        try:
            weights, means, covariances = (
                np.array([word[key] for word in entries['words']], np.float64)
                for key in ('weight', 'mean', 'covariance')
            )
            scale, fill, aspect = (
                float(entries[key]) for key in ('orientation_scale', 'fill', 'aspect')
            )
            provenance = {str(key): str(value) for key, value in entries['provenance'].items()}
            return cls(weights, means, covariances, scale, fill, aspect, provenance)
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            raise VocabularyError(f'{name} is no complete vocabulary: {error!r}') from error
        except VocabularyError as error:
            raise VocabularyError(f'{name}: {error}') from error


@functools.cache
def default_vocabulary() -> Vocabulary:
    """Return the shipped ten words; VocabularyError if the installation is damaged."""
    return Vocabulary.load(Path(__file__).with_name('vocabulary.json'))


@kernel('f4[:,::1], f4[:,:,::1], f4[:,::1], f4[::1], f4[:,::1]')
def _fill_log_densities(features, whitening, offset, constant, logs):  # type: ignore[no-untyped-def]
    # Not a matrix product: BLAS would wake its threads for a fraction of a millisecond.
    for point in range(features.shape[0]):
        z = features[point]
        for word in range(whitening.shape[0]):
            square = np.float32(0)
            for row in range(4):
                white = -offset[word, row]
                for column in range(row + 1):
                    white += whitening[word, row, column] * z[column]
                square += white * white
            logs[point, word] = constant[word] - np.float32(0.5) * square
