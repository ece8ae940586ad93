# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the surroundings look like pixel by pixel, carried along with the camera's motion."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import Window
from gait_segmentation.lab import NO_CHROMA, gray_lab
from gait_segmentation.medians import median
from gait_segmentation.scene.background.kernels import (
    LIMIT,
    SAMPLE_STEP,
    SURE_COUNT,
    sample_residuals,
    update_sums,
    weigh,
)
from gait_segmentation.scene.ego_motion.world_motion import WorldMotion
from gait_segmentation.warping import warp_window

__all__ = ['BackgroundModel']

_WARP_DECAY = 0.98
_LEAST_SAMPLES = 50

_STEEP = 4.0
"""Slope per pixel, in ``sigma``, from which residuals tell of a wrong place."""

_NOISE_PLACE = 0.25
"""What noise alone makes of steep pixels, in pixels."""

_PLACE_RATE = 0.5
_JOLT = 0.5
"""Pixels by which a frame must be off more than those before to be a jolt: more than drift."""

_OF_MEDIAN = 1.4826
"""Standard deviation of normal residuals over the median of their absolute values."""

_SIGMA_START, _SIGMA_LOW, _SIGMA_HIGH = 5.0, 2.5, 14.0


class BackgroundModel:
    """
    Running mean of each pixel of the surroundings in Lab, and how often it was seen.

    ``sums`` is (h, w, 4) float32: L, a, b, each times the count, and the count, so that the
    moved model is a warp of the sums; unknown pixels are zero.  ``sigma`` is the spread of a pixel
    about its mean in grey levels, measured on the surroundings: it grows by itself where parallax
    or a bad registration spoils the model, which makes the model safe there.  ``misplacement`` is
    how far the model lies off the frame, in pixels, measured where it is steep: sharp edges differ
    by that even if the camera's motion is known well, since each motion blurs the model.
    """

    def __init__(self, shape: tuple[int, int]) -> None:
        """Make a model that knows nothing yet, for a working image of the given (h, w)."""
        self.sums = np.zeros((*shape, 4), np.float32)
        self.sigma = _SIGMA_START
        self.misplacement = 0.0

    @property
    def count(self) -> NDArray[np.float32]:
        """Return how often each pixel was seen, (h, w) float32."""
        return self.sums[..., 3]

    @property
    def mean(self) -> NDArray[np.float32]:
        """Return the mean of each pixel, (h, w, 3) float32, zero where it is unknown."""
        return self.sums[..., :3] / np.maximum(self.sums[..., 3:], np.float32(1e-6))

    def part(self, window: Window) -> tuple[NDArray[np.float32], int, int]:
        """Return contiguous sums that hold a window, and the row and column it begins in."""
        rows, columns = window
        if rows.step is None and columns.step is None:
            return self.sums, rows.start, columns.start
        return np.ascontiguousarray(self.sums[window]), 0, 0

    def contradicted(
        self, lab: NDArray[np.uint8], window: Window, shadow_floor: float
    ) -> NDArray[np.uint8]:
        """
        Return where a frame surely does not look like the known background, (h, w) uint8 0/1.

        :param lab, window, shadow_floor: see :meth:`evidence`.
        """
        strange = self._weighed(lab, window, shadow_floor) >= LIMIT
        return (strange & self.is_sure(window)).view(np.uint8)

    def evidence(
        self, lab: NDArray[np.uint8], window: Window, shadow_floor: float
    ) -> NDArray[np.float32]:
        """
        Return log-odds that pixels are not the background, (h, w) float32 within +-3.

        They are 0 where it is not known.  What is a little darker and of the same chroma is hardly
        clothes of just that colour; the darker a shadow would be, the less is said.

        :param lab: (h, w, 3) uint8, the window of the frame.
        :param window: its rows and columns.
        :param shadow_floor: darkest shadow, as a share of the lightness.
        """
        count = self.count[window]
        return self._weighed(lab, window, shadow_floor) * (count / (count + 1))

    def _weighed(
        self, lab: NDArray[np.uint8], window: Window, shadow_floor: float
    ) -> NDArray[np.float32]:
        """Return the evidence, however often pixels were seen, if they are known at all."""
        out = np.empty(lab.shape[:2], np.float32)
        sums, top, left = self.part(window)
        weigh(sums, lab, top, left, self.sigma, shadow_floor, out)
        return out

    def agreement(
        self, lab: NDArray[np.uint8], person: NDArray[np.uint8], windows: Sequence[Window]
    ) -> float | None:
        """
        Return the share of what is sure to be there that a frame shows, None if that is little.

        :param lab: (h, w, 3) uint8.
        :param person: (h, w) uint8, non-zero where a person may be.
        :param windows: the rows and columns to look at.
        """
        total = other = 0
        for window in windows:
            every = _every(window, SAMPLE_STEP)
            free = person[every] == 0
            strange = self.contradicted(np.ascontiguousarray(lab[every]), every, 1.0)
            total += np.count_nonzero(self.is_sure(every) & free)
            other += np.count_nonzero(strange & free)
        return 1 - other / total if total >= _LEAST_SAMPLES else None

    def is_sure(self, window: Window) -> NDArray[np.bool_]:
        """Return which pixels of a window were seen often enough to be sure, (h, w)."""
        return self.count[window] >= np.float32(SURE_COUNT)

    def forget(self, where: NDArray[np.uint8]) -> None:
        """
        Forget some pixels.

        :param where: (h, w) uint8, non-zero where to forget.
        """
        self.sums[where > 0] = 0

    def fade(self, textured: bool) -> None:
        """
        Go on as if all that was seen had been grey, of the same lightness.

        :param textured: whether gradient energy stands for colours, which is that of the mean.
        """
        mean = np.full((*self.sums.shape[:2], 3), NO_CHROMA, np.uint8)
        mean[..., 0] = np.rint(self.mean[..., 0])
        if textured:
            gray = cv2.cvtColor(cv2.cvtColor(mean, cv2.COLOR_Lab2BGR), cv2.COLOR_BGR2GRAY)
            mean = gray_lab(np.asarray(gray))
            # There is no gradient to what is not known.
            unknown = (self.count == 0).view(np.uint8)
            self.forget(cv2.dilate(unknown, np.ones((5, 5), np.uint8)))
        self.sums[..., 1:3] = mean[..., 1:] * self.sums[..., 3:]

    def adopt(self, other: BackgroundModel) -> None:
        """Take over what another model of the same frame and size knows better."""
        if not np.any(self.count):
            self.sigma = other.sigma
        more = other.count > self.count
        self.sums[more] = other.sums[more]

    def resized(self, shape: tuple[int, int]) -> BackgroundModel:
        """Return the model for a working image of another (h, w)."""
        other = BackgroundModel((0, 0))
        smaller = shape[0] < self.sums.shape[0]
        way = cv2.INTER_AREA if smaller else cv2.INTER_LINEAR
        other.sums = np.asarray(cv2.resize(self.sums, shape[::-1], interpolation=way))
        other.sigma, other.misplacement = self.sigma, self.misplacement
        return other

    def moved(
        self, steps: Sequence[WorldMotion], windows: Sequence[Window] | None = None
    ) -> BackgroundModel:
        """
        Return the model as it looks after some motions of the world; this one if it stays.

        :param steps: from each frame to the next, oldest first.
        :param windows: the rows and columns to keep, all if None.
        """
        moves = sum(step.camera is not None for step in steps)
        if moves == 0:
            return self
        other = BackgroundModel(self.sums.shape[:2])
        other.sigma, other.misplacement = self.sigma, self.misplacement
        motion, decay = WorldMotion.over(steps).transform, np.float32(_WARP_DECAY**moves)
        for window in self._all if windows is None else windows:
            # Linear interpolation, frame after frame, would take the contrast out of fine stripes,
            # which then differ from every new frame.
            part = warp_window(self.sums, motion, window, cv2.BORDER_CONSTANT, cv2.INTER_CUBIC)
            np.multiply(np.maximum(part, 0, out=part), decay, out=other.sums[window])
        return other

    @property
    def _all(self) -> list[Window]:
        return [(slice(0, self.sums.shape[0]), slice(0, self.sums.shape[1]))]

    def learn(
        self,
        lab: NDArray[np.uint8],
        person: NDArray[np.uint8],
        windows: Sequence[Window] | None = None,
    ) -> None:
        """
        Take in one frame.

        :param lab: (h, w, 3) uint8.
        :param person: (h, w) uint8, non-zero where a person may be: not learnt.
        :param windows: the rows and columns to learn, disjoint; all if None.
        """
        for part in self._all if windows is None else windows:
            update_sums(self.sums, lab, person, *_bounds(part))

    def measure_noise(
        self, lab: NDArray[np.uint8], person: NDArray[np.uint8], windows: Sequence[Window]
    ) -> None:
        """
        Update ``sigma`` and ``misplacement`` from the residuals about the person.

        Before the frame is learnt.

        :param lab: (h, w, 3) uint8.
        :param person: (h, w) uint8, non-zero where a person may be.
        :param windows: the rows and columns to look at.
        """
        residuals, places = self._residuals(lab, person, windows)
        misplaced = _misplaced(places)
        if len(residuals):
            spread = 1.2 * _OF_MEDIAN * float(median(residuals)) + 1.5
            self.sigma = min(max(0.9 * self.sigma + 0.1 * spread, _SIGMA_LOW), _SIGMA_HIGH)
        if misplaced is not None:
            self.misplacement += _PLACE_RATE * (misplaced - self.misplacement)

    def notice_jolt(
        self, lab: NDArray[np.uint8], person: NDArray[np.uint8], windows: Sequence[Window]
    ) -> None:
        """
        Raise ``misplacement`` to what a frame shows that is about to be judged.

        A camera that is knocked, or a film between whose frames something is missing, is off by
        more than in the frames before for one frame, in which all edges would be the person's.

        :param lab, person, windows: see :meth:`measure_noise`.
        """
        misplaced = _misplaced(self._residuals(lab, person, windows)[1])
        if misplaced is not None and misplaced > self.misplacement + _JOLT:
            self.misplacement = misplaced

    def _residuals(
        self, lab: NDArray[np.uint8], person: NDArray[np.uint8], windows: Sequence[Window]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return by how many grey levels and pixels parts of a frame are off, none if few tell."""
        size = sum(self.sums[_every(window, SAMPLE_STEP)].size for window in windows)
        residuals, places = np.empty(size, np.float32), np.empty(size, np.float32)
        found = steeps = 0
        for window in windows:
            more, steeper = sample_residuals(
                self.sums,
                lab,
                person,
                *_bounds(window),
                _STEEP * self.sigma,
                residuals[found:],
                places[steeps:],
            )
            found, steeps = found + more, steeps + steeper
        enough = found >= 3 * _LEAST_SAMPLES
        return residuals[: enough * found], places[: enough * steeps]


def _misplaced(places: NDArray[np.float32]) -> float | None:
    """Return by how many pixels a frame is off, of which parts are, None if few tell."""
    if len(places) < _LEAST_SAMPLES:
        return None
    misplaced = _OF_MEDIAN * float(median(places))
    return max(misplaced**2 - _NOISE_PLACE**2, 0.0) ** 0.5


def _every(window: Window, step: int) -> Window:
    """Return some of the rows and columns of a window."""
    rows, columns = window
    return slice(rows.start, rows.stop, step), slice(columns.start, columns.stop, step)


def _bounds(window: Window) -> tuple[int, int, int, int]:
    """Return the first row and the one after the last, and the same of the columns."""
    rows, columns = window
    return rows.start, rows.stop, columns.start, columns.stop
