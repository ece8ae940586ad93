# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the surroundings look like pixel by pixel, carried along with the camera's motion."""

from __future__ import annotations

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.geometry import pixel_affine

__all__ = ['BackgroundModel']

_MAX_COUNT = 30.0
_MIN_RATE = 0.04
_WARP_DECAY = 0.98
_LEAST_COUNT = 0.5
_SAMPLE_STEP = 3
_HIDDEN_DECAY = 0.995
_SIGMA_START, _SIGMA_LOW, _SIGMA_HIGH = 5.0, 2.5, 14.0


@njit(cache=True, nogil=True)
def _update(state: NDArray[np.float32], lab: NDArray[np.uint8], person: NDArray[np.uint8]) -> None:
    for row in range(lab.shape[0]):
        for col in range(lab.shape[1]):
            if person[row, col]:
                state[row, col, 3] *= _HIDDEN_DECAY
                continue
            count = state[row, col, 3]
            rate = np.float32(max(1 / (count + 1), _MIN_RATE))
            for channel in range(3):
                state[row, col, channel] += rate * (
                    np.float32(lab[row, col, channel]) - state[row, col, channel]
                )
            state[row, col, 3] = min(count + 1, _MAX_COUNT)


@njit(cache=True, nogil=True)
def _weighed(state: NDArray[np.float32]) -> NDArray[np.float32]:
    out = np.empty_like(state)
    for row in range(state.shape[0]):
        for col in range(state.shape[1]):
            count = state[row, col, 3]
            for channel in range(3):
                out[row, col, channel] = count * state[row, col, channel]
            out[row, col, 3] = count
    return out


@njit(cache=True, nogil=True)
def _unweigh(state: NDArray[np.float32]) -> None:
    for row in range(state.shape[0]):
        for col in range(state.shape[1]):
            count = state[row, col, 3]
            if count < _LEAST_COUNT:
                state[row, col, :] = 0
                continue
            for channel in range(3):
                state[row, col, channel] /= count
            state[row, col, 3] = count * np.float32(_WARP_DECAY)


class BackgroundModel:
    """
    Running mean of each pixel of the surroundings in Lab, and how often it was seen.

    ``state`` is (h, w, 4) float32: L, a, b, count.  ``sigma`` is the spread of a pixel about its
    mean in grey levels, measured on the surroundings: it grows by itself where parallax or a bad
    registration spoils the model, which makes the model safe there.
    """

    def __init__(self, shape: tuple[int, int]) -> None:
        """Make a model that knows nothing yet, for a working image of the given (h, w)."""
        self.state = np.zeros((*shape, 4), np.float32)
        self.sigma = _SIGMA_START

    def moved(self, motions: list[NDArray[np.float64] | None]) -> BackgroundModel:
        """
        Return the model as it looks after some motions of the camera; this one stays.

        :param motions: transforms as for :meth:`move`, oldest first.
        """
        if all(motion is None for motion in motions):
            return self
        other = BackgroundModel((0, 0))
        other.state, other.sigma = self.state, self.sigma
        for motion in motions:
            other.move(motion)
        return other

    def move(self, motion: NDArray[np.float64] | None) -> None:
        """
        Carry the model along with the camera.

        :param motion: 2 x 3 transform of positions from the last frame to this one, None for a
            camera that stands still (nothing is resampled then).
        """
        if motion is None:
            return
        height, width = self.state.shape[:2]
        # Weighted by the count, so that the unknown does not pull its neighbours towards black.
        self.state = cv2.warpAffine(
            _weighed(self.state), pixel_affine(motion), (width, height), flags=cv2.INTER_LINEAR
        )
        _unweigh(self.state)

    def learn(self, lab: NDArray[np.uint8], person: NDArray[np.uint8]) -> None:
        """
        Take in one frame.

        :param lab: (h, w, 3) uint8.
        :param person: (h, w) uint8, non-zero where a person may be: not learnt.
        """
        _update(self.state, lab, person)

    def measure_noise(
        self, lab: NDArray[np.uint8], person: NDArray[np.uint8], window: tuple[slice, slice]
    ) -> None:
        """
        Update ``sigma`` from the residuals about the person, before the frame is learnt.

        :param lab: (h, w, 3) uint8.
        :param person: (h, w) uint8, non-zero where a person may be.
        :param window: rows and columns to look at.
        """
        rows, columns = (slice(part.start, part.stop, _SAMPLE_STEP) for part in window)
        step = (rows, columns)
        state = self.state[step]
        use = (person[step] == 0) & (state[:, :, 3] >= 1)
        if np.count_nonzero(use) < 50:
            return
        residual = np.abs(lab[step].astype(np.float32) - state[:, :, :3])[use]
        spread = 1.2 * 1.4826 * float(np.median(residual)) + 1.5
        self.sigma = float(np.clip(0.9 * self.sigma + 0.1 * spread, _SIGMA_LOW, _SIGMA_HIGH))
