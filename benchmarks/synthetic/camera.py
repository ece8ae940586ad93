# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What can be chosen about a synthetic clip, and its camera: level, moving sideways."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import BodyFrame

EYE_LEVEL = 0.9
"""Height of the camera above the ground, in statures."""

FOCAL_LENGTH = 1.1
"""In image widths."""


@dataclass(frozen=True)
class SyntheticConfig:
    """
    Parameters of a clip; sizes in pixels, deviations are standard deviations.

    ``person_height`` is that of the first walker half way, who walks towards ``azimuth`` (radians:
    0 right, pi/2 away, -pi/2 closer) with ``stride_rate`` strides (two steps) a second; ``pan`` is
    how far the camera moves to the right a frame, seen on that walker.
    """

    seed: int = 0
    width: int = 320
    height: int = 240
    fps: float = 25.0
    frames: int = 50
    person_height: float = 120.0
    azimuth: float = 0.0
    stride_rate: float = 0.9
    build: str = 'average'
    walkers: int = 1
    pan: float = 0.0
    jitter: float = 0.3
    """Deviation of the camera's shake."""

    clutter: float = 0.5
    """Things before the wall: 0 none, 1 crowded."""

    shadow: bool = False
    """Whether walkers cast soft shadows."""

    noise: float = 3.0
    """Deviation of the sensor's noise, grey levels."""

    blur: float = 0.5
    """Deviation of the lens's blur."""


class SyntheticCamera:
    """
    Where things of the place are seen, in pixels.

    ``distance`` is that of the first walker half way, in statures; ``margin_x`` and ``margin_y``
    are what pictures of the whole place, such as a panorama, have on each side beyond the image.
    """

    def __init__(self, config: SyntheticConfig, rng: np.random.Generator) -> None:
        """Draw the shake."""
        self._config = config
        self._focal = FOCAL_LENGTH * config.width
        # Level with the middle of the first walker's way, so that feet and head have room.
        self._horizon = config.height / 2 + (0.5 - EYE_LEVEL) * config.person_height
        self.distance = self._focal / config.person_height
        self._shake = _shake(config.jitter, rng.standard_normal((config.frames, 2)))
        moved = 4 * config.jitter + 4
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
