# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The choice of features while a person is tracked.

All features are ranked by their variance ratio on the person, as the last mask says, against the
surroundings.  Joint colour and background are always used; the best of the others join in where
they tell the two clearly better apart than those do.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.results import FeatureWeight
from gait_segmentation.tracking.features.histograms import (
    ChannelModel,
    class_histograms,
    pixels_ratio,
)
from gait_segmentation.tracking.features.pool import POOL, ChannelFeature, Feature, View

__all__ = ['STEP', 'FeatureSelector', 'labels_of']

_EVERY = 5
"""Frames between two looks at the features while joint colour and background do well."""

_POOR = 1.25
"""Variance ratio of the likelihood below which it is in need of help."""

_SHARE, _LEAST_RATIO = 0.75, 0.6
"""A feature helps a poor likelihood with this share of its ratio, and at least this ratio."""

_LEAD = 1.5
"""It joins a good likelihood only with this many times its ratio."""

_ALIKE = 0.8
"""Correlation with a better feature from which a feature adds nothing new."""

_MOST, _MOST_WEIGHT, _LIMIT = 3, 1.5, 4.0
"""Number of features that may join, their largest weights and log-likelihood ratios."""

STEP = 2
"""Every how many pixels are looked at to rank and to learn."""


_CHANNELS = tuple(feature for feature in POOL if isinstance(feature, ChannelFeature))


def labels_of(mask: NDArray[np.uint8], step: int = STEP) -> NDArray[np.uint8]:
    """
    Return 1 on the person, 0 off it and 2 about its outline, of every ``step``-th pixel.

    :param mask: (h, w) uint8 0/255.
    """
    thin, square = np.ascontiguousarray(mask[::step, ::step]), np.ones((3, 3), np.uint8)
    inner, outer = cv2.erode(thin, square) > 127, cv2.dilate(thin, square) > 127
    return 2 * outer.view(np.uint8) - inner.view(np.uint8)


@dataclass(frozen=True)
class _Choice:
    feature: Feature
    weight: float


class FeatureSelector:
    """
    Ranks the pool for one person and adds what helps to the likelihood.

    ``features`` holds all features with something to say at the last look, best first.
    """

    def __init__(self) -> None:
        """Know nothing yet."""
        self._models = {f.name: ChannelModel(has_neutral=f.has_neutral) for f in _CHANNELS}
        self._learnt = 0
        self._looked = 0
        self._chosen: list[_Choice] = []
        self.features: tuple[FeatureWeight, ...] = ()

    def learn(self, view: View, mask: NDArray[np.uint8], rate: float) -> None:
        """
        Learn the histograms from a frame whose mask is known; now and then is enough.

        :param view: the pixels about the person.
        :param mask: (h, w) uint8 0/255 of the same pixels.
        :param rate: share by which the histograms move towards one frame.
        """
        self._learnt += 1
        if self._learnt > 1 and not self._chosen and self._learnt % _EVERY:
            return
        frames = 1 if self._chosen else _EVERY
        thin, labels = replace(view, step=STEP), labels_of(mask)
        for feature in _CHANNELS:
            newest = class_histograms(
                feature.channel(thin), labels, has_neutral=feature.has_neutral
            )
            self._models[feature.name].learn(newest, 1 - (1 - rate) ** frames)

    def add(
        self,
        logit: NDArray[np.float32],
        view: View,
        mask: NDArray[np.uint8] | None,
        evidence: Callable[[], dict[str, NDArray[np.float32]]],
    ) -> None:
        """
        Add the chosen features to the likelihood of a frame.

        :param logit: (h, w) float32, what joint colour, background and motion say; changed.
        :param view: the same pixels.
        :param mask: (h, w) uint8 0/255, where the person is thought to be; None if that is not
            known, the choice is then left as it is.
        :param evidence: gives what those say one by one, of every STEP-th pixel.
        """
        if mask is not None:
            labels = labels_of(mask)
            base = pixels_ratio(logit[::STEP, ::STEP], labels)
            self._looked += 1
            if base < _POOR or self._chosen or self._looked % _EVERY == 1:
                self._rank(replace(view, step=STEP, evidence=evidence()), labels, base)
        for choice in self._chosen:
            values = self._log_ratio(choice.feature, view)
            if values is not None:
                logit += np.float32(choice.weight) * np.clip(values, -_LIMIT, _LIMIT)

    def _log_ratio(self, feature: Feature, view: View) -> NDArray[np.float32] | None:
        """Return the log-likelihood ratios of a feature, None if it has nothing to say."""
        if isinstance(feature, ChannelFeature):
            return self._models[feature.name].log_ratio(feature.channel(view))
        return feature.log_ratio(view)

    def _variance_ratio(
        self, feature: Feature, view: View, labels: NDArray[np.uint8]
    ) -> float | None:
        """Return the variance ratio of a feature, None if it has nothing to say."""
        if isinstance(feature, ChannelFeature):
            newest = class_histograms(
                feature.channel(view), labels, has_neutral=feature.has_neutral
            )
            return self._models[feature.name].variance_ratio(newest)
        values = self._log_ratio(feature, view)
        return None if values is None else pixels_ratio(values, labels)

    def _rank(self, view: View, labels: NDArray[np.uint8], base: float) -> None:
        """Rank the features by their variance ratios and choose."""
        ratios = {each: self._variance_ratio(each, view, labels) for each in POOL}
        known = [(ratio, each) for each, ratio in ratios.items() if ratio is not None]
        known.sort(key=lambda item: -item[0])
        least = max(_LEAST_RATIO, _SHARE * base) if base < _POOR else _LEAD * base
        self._chosen = []
        taken: list[NDArray[np.float32]] = []
        for ratio, feature in known:
            if ratio <= least or len(taken) == _MOST:
                break
            values = None if feature.name in view.evidence else self._log_ratio(feature, view)
            if values is None or any(_correlation(values, other) > _ALIKE for other in taken):
                continue
            taken.append(values)
            weight = min(ratio / max(base, 1e-6), _MOST_WEIGHT)
            self._chosen.append(_Choice(feature, weight))
        weights = dict.fromkeys(view.evidence, 1.0)
        weights.update((each.feature.name, each.weight) for each in self._chosen)
        self.features = tuple(
            FeatureWeight(each.name, ratio, weights.get(each.name, 0.0)) for ratio, each in known
        )


def _correlation(one: NDArray[np.float32], two: NDArray[np.float32]) -> float:
    """Return how alike the values are, -1..1, 0 if some do not vary; as ``np.corrcoef`` does."""
    a, b = one.ravel() - one.mean(), two.ravel() - two.mean()
    spread = math.sqrt(float(a @ a) * float(b @ b))
    return float(a @ b) / spread if spread > 0 else 0.0
