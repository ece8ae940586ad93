# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The pool of features of the paper, and the choice of those that tell a person best.

They are joint histograms of the colour spaces (Comaniciu, Ramesh and Meer 2003) and the
orientation of gradients.  All are learnt and ranked in every frame; the likelihood of the next one
is made of the best alone.  The log-likelihood ratio and the variance ratio are those of Collins
and Liu (ICCV 2003), the update by the similarity to the first model that of Wang and Yagi (TIP
2008)::

    L(u)  = ln max(p(u), d) / max(q(u), d)
    VR    = var(L; (p + q) / 2) / (var(L; p) + var(L; q))
    model = (1 - S) first + S current,   S = sum over u of sqrt(first(u) current(u))
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.results import FeatureWeight

NEUTRAL = 0
"""Bin of the pixels that say nothing, in features that have such pixels."""

_ANGLE_BITS = 5
_FIRST = 256 >> _ANGLE_BITS  # angles begin here, in the second bin, so that none is neutral
_NEIGHBOURS = 5  # pixels, of the neighbourhood whose gradients have an orientation
_LEAST_GRADIENT = 150.0  # their mean square, per pixel, that says anything (12 grey levels)

PERSON, SURROUNDINGS = 1, 0
"""Values of labels; any other is left out."""

_DELTA = 1e-3  # least share of a bin in the ratios, d
# Added to the variances within the classes, so that few pixels do not make a perfect feature.
_LEAST_SPREAD = 0.05
_CHOSEN = 3  # features that the likelihood is made of
_DRIFT_GATE = 0.6  # mean similarity (0..1) with the first frame's, of frames that are learnt
_STEP = 2  # step of the pixels that are used to learn and to rank


@dataclass(frozen=True)
class Pixels:
    """
    The part of a frame in which pixels are judged.

    ``bgr`` is (h, w, 3) uint8, ``gray`` (h, w) uint8.  With a ``step`` n features are needed at
    every n-th pixel of every n-th row only.
    """

    bgr: NDArray[np.uint8]
    gray: NDArray[np.uint8]
    step: int = 1

    @cached_property
    def colours(self) -> NDArray[np.uint8]:
        """Return blue, green and red of the pixels that are needed."""
        return np.ascontiguousarray(self.bgr[:: self.step, :: self.step])

    @cached_property
    def hsv(self) -> NDArray[np.uint8]:
        """Return hue, saturation and value of these pixels, all of 0..255."""
        return np.asarray(cv2.cvtColor(self.colours, cv2.COLOR_BGR2HSV_FULL))


@dataclass(frozen=True)
class Feature:
    """
    One or more numbers for each pixel, whose joint histogram is learnt.

    ``planes`` returns them for the pixels that are needed, uint8, of each of which the ``bits``
    highest bits count; with ``has_neutral`` pixels of the bin NEUTRAL say nothing.
    """

    name: str
    planes: Callable[[Pixels], Sequence[NDArray[np.uint8]]]
    bits: tuple[int, ...]
    has_neutral: bool = False

    @property
    def bins(self) -> int:
        """Return the number of bins of the histogram."""
        return 1 << sum(self.bits)

    def places(self, view: Pixels) -> NDArray[np.uint16]:
        """Return the bin of each pixel that is needed, (h, w) uint16."""
        out = np.zeros(view.colours.shape[:2], np.uint16)
        for plane, bits in zip(self.planes(view), self.bits, strict=True):
            out = (out << np.uint16(bits)) | (plane >> np.uint8(8 - bits))
        return out


def _shares(view: Pixels) -> tuple[NDArray[np.uint8], ...]:
    """Return the shares of green and red in the sum of the three, which no brightness changes."""
    blue, green, red = cv2.split(view.colours.astype(np.float32))
    total = np.maximum(blue + green + red, np.float32(1))
    return tuple(
        np.asarray(np.float32(255) * plane / total + 0.5).astype(np.uint8)
        for plane in (green, red)
    )


def _orientation(view: Pixels) -> NDArray[np.uint8]:
    """Return the angle of the structure tensor: of gradients, whichever side is lighter."""
    dx = cv2.Sobel(view.gray, cv2.CV_32F, 1, 0, scale=1 / 8)
    dy = cv2.Sobel(view.gray, cv2.CV_32F, 0, 1, scale=1 / 8)
    squared = cv2.blur(cv2.merge([dx * dx - dy * dy, 2 * dx * dy]), (_NEIGHBOURS, _NEIGHBOURS))
    thin = squared[:: view.step, :: view.step]
    length, angle = cv2.cartToPolar(thin[..., 0].copy(), thin[..., 1].copy())
    values = _FIRST + np.asarray(angle) * np.float32((255 - _FIRST) / (2 * np.pi))
    return np.where(length < _LEAST_GRADIENT, NEUTRAL, np.minimum(values, 255)).astype(np.uint8)


POOL: tuple[Feature, ...] = (
    Feature('RGB', lambda view: cv2.split(view.colours), (3, 3, 3)),
    Feature('HSV', lambda view: cv2.split(view.hsv), (3, 3, 3)),
    Feature('rg', _shares, (5, 5)),
    Feature('HS', lambda view: cv2.split(view.hsv)[:2], (4, 4)),
    Feature('orientation', lambda view: (_orientation(view),), (_ANGLE_BITS,), has_neutral=True),
)
"""All features there are."""


def class_histograms(
    places: NDArray[np.uint16], labels: NDArray[np.uint8], bins: int, *, has_neutral: bool
) -> NDArray[np.float64]:
    """
    Return the histograms of surroundings and person, (2, bins) float64, each with sum one.

    Neutral pixels count in the sums but in no bin; without pixels of a class its row is zero.

    :param places: (h, w) uint16, the bin of each pixel.
    :param labels: (h, w) uint8, 1 person, 0 surroundings, 2 left out.
    """
    joint = (labels.astype(np.intp) * bins + places).ravel()
    counts = np.bincount(joint, minlength=3 * bins)[: 2 * bins].reshape(2, bins)
    out = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    if has_neutral:
        out[:, 0] = 0
    return out


class FeatureModel:
    """The distribution of a feature on the person and in the surroundings."""

    def __init__(self, bins: int, *, has_neutral: bool) -> None:
        """Make a model that knows nothing: all its ratios are zero."""
        self._has_neutral = has_neutral
        self._first: NDArray[np.float64] | None = None
        self.table = np.zeros(bins, np.float32)

    def similarity(self, newest: NDArray[np.float64]) -> float:
        """Return how alike (0..1) the person is in a frame's histograms and was at first."""
        if self._first is None:
            return 1.0
        return min(float(np.sqrt(self._first * newest[PERSON]).sum()), 1.0)

    def adapt(self, newest: NDArray[np.float64]) -> None:
        """Adapt to :func:`class_histograms`, the person's the less the less it is as at first."""
        if newest.sum(axis=1).min() <= 0:
            return
        current = newest[PERSON]
        if self._first is None:
            self._first = current
        person = self._first + self.similarity(newest) * (current - self._first)
        surroundings = np.maximum(newest[SURROUNDINGS], _DELTA)
        self.table = np.log(np.maximum(person, _DELTA) / surroundings).astype(np.float32)
        if self._has_neutral:
            self.table[0] = 0

    def variance_ratio(self, newest: NDArray[np.float64]) -> float:
        """Return how well the model tells the classes apart in a frame's histograms."""
        if newest.sum(axis=1).min() <= 0:
            return 0.0
        means = newest @ self.table
        apart = means[PERSON] - means[SURROUNDINGS]
        if apart <= 0:
            return 0.0
        within = float((newest @ self.table**2 - means**2).sum())
        return float((within / 2 + apart**2 / 4) / (within + _LEAST_SPREAD))


class FeatureSelector:
    """Learns the pool for one person; its ``features`` are as ranked last, best first."""

    def __init__(self) -> None:
        self._models = {
            each.name: FeatureModel(each.bins, has_neutral=each.has_neutral) for each in POOL
        }
        self.features: tuple[FeatureWeight, ...] = ()

    def rank(self, view: Pixels, labels: NDArray[np.uint8]) -> None:
        """
        Adapt to the histograms of a frame, and rank the features by how well they separate it.

        A frame that is too little like the person at first is left out: it shows something else.

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
        if sum(alike) < _DRIFT_GATE * len(alike):
            return
        ratios: dict[str, float] = {}
        for name, model in self._models.items():
            model.adapt(newest[name])
            ratios[name] = model.variance_ratio(newest[name])
        ranked = sorted(ratios, key=lambda name: -ratios[name])
        chosen = ranked[:_CHOSEN]
        total = max(sum(ratios[name] for name in chosen), 1e-6)
        weights = {name: ratios[name] / total for name in chosen}
        self.features = tuple(
            FeatureWeight(name, ratios[name], weights.get(name, 0.0)) for name in ranked
        )

    def log_ratio(self, view: Pixels) -> NDArray[np.float32]:
        """Return the log-likelihood ratios of the chosen features, their weighted mean, (h, w)."""
        out = np.zeros(view.gray.shape, np.float32)
        weights = {each.name: each.weight for each in self.features}
        for each in POOL:
            if weights.get(each.name):
                ratios = self._models[each.name].table[each.places(view)]
                out += np.float32(weights[each.name]) * ratios
        return out
