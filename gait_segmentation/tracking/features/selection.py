# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The likelihood of the features that tell a person best from the surroundings.

All features of the pool are learnt and ranked by their variance ratio in every frame (Collins and
Liu, ICCV 2003; Wang and Yagi, TIP 2008); the likelihood of the next one is made of the best alone.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.results import FeatureWeight
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.features.histograms import FeatureModel, class_histograms
from gait_segmentation.tracking.features.pool import POOL, View

__all__ = ['FeatureSelector']

_STEP = 2
"""Every how many pixels are looked at to learn and to rank."""


class FeatureSelector:
    """
    Learns the pool for one person and makes the likelihood of the best features.

    ``features`` holds all features as they were ranked last, best first.
    """

    def __init__(self, config: TrackingConfig) -> None:
        """Know nothing yet."""
        self._config = config
        self._models = {
            each.name: FeatureModel(each.bins, has_neutral=each.has_neutral) for each in POOL
        }
        self.features: tuple[FeatureWeight, ...] = ()

    def learn(self, view: View, labels: NDArray[np.uint8]) -> None:
        """
        Learn the histograms of a frame, and choose what tells the classes apart in it.

        Nothing is learnt of what is too little like the person at first: it is somebody or
        something else.

        :param view: the pixels about the person.
        :param labels: (h, w) uint8 of the same pixels: 1 person, 0 surroundings, 2 left out.
        """
        thin, labels = replace(view, step=_STEP), labels[::_STEP, ::_STEP]
        newest = {
            each.name: class_histograms(
                each.places(thin), labels, each.bins, has_neutral=each.has_neutral
            )
            for each in POOL
        }
        alike = [model.similarity(newest[name]) for name, model in self._models.items()]
        if sum(alike) < self._config.drift_gate * len(alike):
            return
        ratios: dict[str, float] = {}
        for name, model in self._models.items():
            model.learn(newest[name])
            ratios[name] = model.variance_ratio(newest[name])
        ranked = sorted(ratios, key=lambda name: -ratios[name])
        chosen = ranked[: self._config.chosen_features]
        total = max(sum(ratios[name] for name in chosen), 1e-6)
        weights = {name: ratios[name] / total for name in chosen}
        self.features = tuple(
            FeatureWeight(name, ratios[name], weights.get(name, 0.0)) for name in ranked
        )

    def log_ratio(self, view: View) -> NDArray[np.float32]:
        """Return the log-likelihood ratios of the chosen features, their weighted mean, (h, w)."""
        out = np.zeros(view.gray.shape, np.float32)
        weights = {each.name: each.weight for each in self.features}
        for each in POOL:
            if weights.get(each.name):
                ratios = self._models[each.name].log_ratio(each.places(view))
                out += np.float32(weights[each.name]) * ratios
        return out
