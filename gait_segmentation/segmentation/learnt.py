# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
What is learnt of a person from frame to frame: colours, and where on the body a mask is likely.

A likelihood from outside may be blurred, shifted and full of holes; but not everywhere and always
in the same way, so that the colours learnt from it are better evidence than it is.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.colour import BANDS, ColourModel, body_rows, colour_bins
from gait_segmentation.geometry import BodyFrame, pixel_affine, template_to_image

_BAND_SHARE = 0.6  # weight of a band and its neighbours beside the whole body
_FLOOR = 1e-4
_KEPT = 0.9  # weight of a frame over that of the one after it
_LIMIT = 4.0  # largest log-odds of a colour
_FROM_LIKELIHOOD = 0.3  # weight of the likelihood in what is learnt beside that of the cut
# Rows and columns of the map of the body, and the share of them that its height takes.
_SIDE, _FILL = 96, 0.75
# Share of a frame in the running mean: what is likely from now on counts after fourteen frames, in
# which a wide thing that stays behind has moved on.
_RATE = 0.05


class LearntColours:
    """Running histograms of surroundings and person by height on the body, over ten frames."""

    def __init__(self) -> None:
        self._models = tuple(ColourModel(_BAND_SHARE, _FLOOR) for _ in range(2))
        self._frames = 0

    @property
    def ready(self) -> bool:
        """Return whether there is anything learnt."""
        return self._frames > 0

    def add_frame(
        self,
        lab: NDArray[np.uint8],
        body: BodyFrame,
        likelihood: NDArray[np.uint8],
        labels: NDArray[np.bool_] | None = None,
    ) -> None:
        """
        Update the histograms with a frame.

        :param lab: (h, w, 3) uint8, the colours.
        :param body: the body in its pixels.
        :param likelihood: (h, w) uint8; what is about one half teaches little.
        :param labels: (h, w) bool, the cut, which teaches more; None: there is none yet.
        """
        sure = likelihood * np.float32(2 / 255) - 1
        weights = [sure**2 * (sure <= 0), sure**2 * (sure > 0)]
        if labels is not None:
            # Pixels that touch the person are mixtures.
            clear = cv2.dilate(labels.view(np.uint8), np.ones((3, 3), np.uint8)) == 0
            share = np.float32(_FROM_LIKELIHOOD)
            weights = [
                share * weight + (1 - share) * own
                for weight, own in zip(weights, (clear, labels), strict=True)
            ]
        bins, rows = colour_bins(lab), _rows(lab, body)
        self._frames += 1
        rate = (1 - _KEPT) / (1 - _KEPT**self._frames)
        for model, weight in zip(self._models, weights, strict=True):
            model.accumulate(bins, rows, np.ascontiguousarray(weight, np.float32), rate)

    def odds(self, lab: NDArray[np.uint8], body: BodyFrame) -> NDArray[np.float32]:
        """Return log-odds, (h, w) float32, of the colours of (h, w, 3) uint8 Lab about a body."""
        if not all(model.body_histogram().any() for model in self._models):
            return np.zeros(lab.shape[:2], np.float32)
        bins = colour_bins(lab)
        bands = np.clip(_rows(lab, body) * BANDS, 0, BANDS - 1).astype(np.intp)
        other, own = (model.table[bins, bands] for model in self._models)
        return np.clip(np.log(own / other), -_LIMIT, _LIMIT)


class MeanLikelihood:
    """
    Running mean of the likelihood in the frame of the body.

    What passes by, and what was taken for the person at first and stays behind, is soon at
    another place on the body; a bag in the hand is not.
    """

    def __init__(self) -> None:
        self._mean = np.zeros((_SIDE, _SIDE), np.float32)

    def at(self, body: BodyFrame, shape: tuple[int, ...]) -> NDArray[np.bool_]:
        """Return what was mostly likely until now, (h, w) bool, for a body in an image."""
        matrix = _matrix(body)
        return np.asarray(cv2.warpAffine(self._mean, matrix, (shape[1], shape[0])) > 0.5)

    def add_frame(self, likelihood: NDArray[np.uint8], body: BodyFrame) -> None:
        """Update the mean with a likelihood, (h, w) uint8, and the body in its pixels."""
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        now = cv2.warpAffine(likelihood, _matrix(body), (_SIDE, _SIDE), flags=flags)
        cv2.accumulateWeighted(now / np.float32(255), self._mean, _RATE)


def _rows(lab: NDArray[np.uint8], body: BodyFrame) -> NDArray[np.float32]:
    center = (body.center_x, body.center_y)
    return body_rows((lab.shape[0], lab.shape[1]), (0, 0), center, body.height, body.angle)


def _matrix(body: BodyFrame) -> NDArray[np.float64]:
    return pixel_affine(template_to_image(body, _SIDE, _SIDE, _FILL * _SIDE))
