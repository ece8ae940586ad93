# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The camera of a synthetic clip, which looks level and moves sideways."""

from __future__ import annotations

import math
from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.synthetic.config import SyntheticConfig
from gait_segmentation.geometry import BodyFrame

__all__ = ['EYE_LEVEL', 'FOCAL_LENGTH', 'SyntheticCamera']

EYE_LEVEL = 0.9
"""Height of the camera above the ground, in statures."""

FOCAL_LENGTH = 1.1
"""In image widths."""


class SyntheticCamera:
    """
    Where things of the place are seen, in pixels.

    ``distance`` is that of the first walker half way, in statures; ``margin_x`` and ``margin_y``
    are what pictures of the whole place, such as a panorama, have on each side beyond the image.
    """

    def __init__(
        self,
        config: SyntheticConfig,
        rng: np.random.Generator,
        sway: Callable[[int], tuple[float, float]],
    ) -> None:
        """
        Draw the shake.

        :param sway: (x, y) pixels by which a frame is moved beside pan and shake.
        """
        self._config = config
        self._focal = FOCAL_LENGTH * config.width
        # Level with the middle of the first walker's way, so that feet and head have room.
        self._horizon = config.height / 2 + (0.5 - EYE_LEVEL) * config.person_height
        self.distance = self._focal / config.person_height
        swaying = np.array([sway(number) for number in range(config.frames)], np.float64)
        self._shake = _shake(config.jitter, rng.standard_normal((config.frames, 2))) + swaying
        moved = 4 * config.jitter + 4 + np.abs(swaying).max()
        self.margin_y = math.ceil(moved)
        self.margin_x = math.ceil(abs(config.pan) * config.frames / 2 + moved)

    @property
    def place_shape(self) -> tuple[int, int]:
        """Return rows and columns of a picture of the whole place."""
        config = self._config
        return config.height + 2 * self.margin_y, config.width + 2 * self.margin_x

    def height_at(self, distance: float) -> float:
        """Return how many pixels a stature is at a distance in statures."""
        return self._focal / distance

    def ground_at(self, distance: float) -> float:
        """Return the row, in a picture of the whole place, of the ground at a distance."""
        return self._horizon + EYE_LEVEL * self.height_at(distance) + self.margin_y

    def body_at(self, x: float, z: float, number: int) -> BodyFrame:
        """Return where somebody at (x, z) is seen in a frame."""
        height = self.height_at(z)
        dx, dy = self._shift(number, self.distance / z)
        center_y = self._horizon + (EYE_LEVEL - 0.5) * height
        return BodyFrame(self._config.width / 2 + x * height + dx, center_y + dy, height)

    def view(self, picture: NDArray[np.generic], number: int, share: float) -> NDArray[np.float32]:
        """
        Cut what a frame shows out of a picture of the whole place.

        :param share: speed with which the picture passes, over that of the first walker's.
        """
        dx, dy = self._shift(number, share)
        matrix = np.array([[1, 0, dx - self.margin_x], [0, 1, dy - self.margin_y]])
        size = (self._config.width, self._config.height)
        moved = cv2.warpAffine(
            picture, matrix, size, flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE
        )
        return np.asarray(moved, np.float32)

    def _shift(self, number: int, share: float) -> tuple[float, float]:
        """Return how far the picture moves; near things (share 1) pass faster than the wall."""
        passed = self._config.pan * (number - (self._config.frames - 1) / 2)
        return share * -passed + self._shake[number, 0], float(self._shake[number, 1])


def _shake(jitter: float, steps: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (frames, 2) displacements of the picture, correlated as a hand's are."""
    shake = np.zeros_like(steps)
    for number in range(1, len(steps)):
        shake[number] = 0.8 * shake[number - 1] + 0.6 * steps[number]
    return np.clip(jitter * shake, -3 * jitter, 3 * jitter)
