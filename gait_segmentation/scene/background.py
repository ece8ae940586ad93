# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the surroundings look like pixel by pixel, moved along with the camera's motion."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from statistics import NormalDist

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.colour import NO_CHROMA, gray_lab
from gait_segmentation.images import Window, median
from gait_segmentation.kernels import kernel
from gait_segmentation.scene.ego_motion import WorldMotion

_MOST_COUNT = 25.0
"""Times a pixel counts as seen at most, so that it goes on learning."""

_SAMPLE_STEP = 3
"""Of so many rows and columns one is looked at to measure the noise."""

SURE_COUNT = 2.0
"""Times a pixel was seen to be sure what is there."""

_NEUTRAL, _GAIN = 4.0, 0.75
_LIMIT = _GAIN * _NEUTRAL
"""
Half the squared distance in ``sigma`` that says nothing, evidence per step, and its limit, which
is reached four ``sigma`` away.
"""

LEAST_SAMPLES = 50
"""Pixels, or cells of them, that are needed to tell something of all of the image."""

_STEEP = 4.0
"""Slope per pixel, in ``sigma``, from which residuals tell of a wrong place."""

_PLACE = 0.5
"""
Pixels by which a frame is off more than those before after a jolt; share by which the place
follows what drifts.
"""

_NOISE_PLACE = 0.25
"""What noise alone makes of steep pixels, in pixels."""

_OF_MEDIAN = 1 / NormalDist().inv_cdf(0.75)
"""Standard deviation of normal residuals over the median of their absolute values."""

_SIGMA_LOW, _SIGMA_HIGH = 2.5, 14.0


class BackgroundModel:
    """
    Running mean of each pixel of the surroundings in Lab, and how often it was seen.

    ``sums`` is (h, w, 4) float32: L, a, b, each times the count, and the count, so that the
    moved model is a warp of the sums; unknown pixels are zero.  ``sigma`` is the spread of a pixel
    about its mean in grey levels, measured on the surroundings: it grows by itself where parallax
    or a bad registration spoils the model, which makes the model safe there.  ``misplacement`` is
    how far the model lies off the frame, in pixels, measured where it is steep: sharp edges differ
    by that even if the camera's motion is known well, since each motion blurs the model.

    In all methods ``lab`` is (h, w, 3) uint8 and ``person`` (h, w) uint8, non-zero where a person
    may be; ``windows`` are the rows and columns to work on, disjoint, all if None.
    """

    def __init__(self, shape: tuple[int, int]) -> None:
        """Make a model that knows nothing yet, for a working image of the given (h, w)."""
        self.sums = np.zeros((*shape, 4), np.float32)
        self.sigma = 2 * _SIGMA_LOW
        self.misplacement = 0.0

    @property
    def count(self) -> NDArray[np.float32]:
        """Return how often each pixel was seen, (h, w) float32."""
        return self.sums[..., 3]

    @property
    def mean(self) -> NDArray[np.float32]:
        """Return the mean of each pixel, (h, w, 3) float32, zero where it is unknown."""
        return self.sums[..., :3] / np.maximum(self.sums[..., 3:], np.float32(1e-6))

    def contradicted(
        self, lab: NDArray[np.uint8], window: Window, shadow_floor: float
    ) -> NDArray[np.uint8]:
        """Return where the :meth:`evidence` is sure not to be the background, (h, w) uint8 0/1."""
        strange = self._weighed(lab, window, shadow_floor) >= _LIMIT
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
        """Return the evidence however often pixels were seen, if they are known at all."""
        out = np.empty(lab.shape[:2], np.float32)
        _weigh(np.ascontiguousarray(self.sums[window]), lab, self.sigma, shadow_floor, out)
        return out

    def agreement(
        self, lab: NDArray[np.uint8], person: NDArray[np.uint8], windows: Sequence[Window]
    ) -> float:
        """Return the share of what is sure to be there that a frame shows, 1 if few tell."""
        total = other = 0
        for window in windows:
            every = _sampled(window)
            free = person[every] == 0
            strange = self.contradicted(np.ascontiguousarray(lab[every]), every, 1.0)
            total += np.count_nonzero(self.is_sure(every) & free)
            other += np.count_nonzero(strange & free)
        return 1 - other / total if total >= LEAST_SAMPLES else 1.0

    def is_sure(self, window: Window) -> NDArray[np.bool_]:
        """Return which pixels of a window were seen often enough to be sure, (h, w)."""
        return self.count[window] >= np.float32(SURE_COUNT)

    def forget(self, where: NDArray[np.uint8]) -> None:
        """Forget the pixels where an image, (h, w) uint8, is not zero."""
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

    def merge(self, other: BackgroundModel) -> None:
        """Take over what another model of the same frame and size knows better."""
        if not np.any(self.count):
            self.sigma = other.sigma
        more = other.count > self.count
        self.sums[more] = other.sums[more]

    def resized(self, shape: tuple[int, int]) -> BackgroundModel:
        """Return the model for a working image of another (h, w)."""
        other = copy.copy(self)
        way = cv2.INTER_AREA if shape[0] < self.sums.shape[0] else cv2.INTER_LINEAR
        other.sums = np.asarray(cv2.resize(self.sums, shape[::-1], interpolation=way))
        return other

    def moved(
        self, motion: WorldMotion, windows: Sequence[Window] | None = None
    ) -> BackgroundModel:
        """Return the model as it looks after a motion of the world; this one if it stays."""
        if motion.camera is None:
            return self
        other = copy.copy(self)
        other.sums = np.zeros_like(self.sums)
        for window in self._all if windows is None else windows:
            # Linear interpolation, frame after frame, would take the contrast out of fine stripes,
            # which then differ from every new frame.
            part = motion.warped(self.sums, window, cv2.BORDER_CONSTANT, cv2.INTER_CUBIC)
            np.maximum(part, 0, out=other.sums[window])
        return other

    @property
    def _all(self) -> list[Window]:
        return [(slice(0, self.sums.shape[0]), slice(0, self.sums.shape[1]))]

    def add(
        self,
        lab: NDArray[np.uint8],
        person: NDArray[np.uint8],
        windows: Sequence[Window] | None = None,
    ) -> None:
        """Take in what a frame shows beside the person."""
        for rows, columns in self._all if windows is None else windows:
            bounds = rows.start, rows.stop, columns.start, columns.stop
            _update_sums(self.sums, lab, person, *bounds)

    def measure_noise(
        self, lab: NDArray[np.uint8], person: NDArray[np.uint8], windows: Sequence[Window]
    ) -> None:
        """Update ``sigma`` by a frame that is not learnt yet."""
        parts = [np.empty(0, np.float32)]
        for window in windows:
            every = _sampled(window)
            mean = self._known(every)
            use = (person[every] == 0) & (mean[..., 0] >= 0)
            parts.append(np.abs(lab[every][use] - mean[use]).ravel())
        residuals = np.concatenate(parts)
        if len(residuals) >= 3 * LEAST_SAMPLES:
            spread = 1.2 * _OF_MEDIAN * float(median(residuals)) + 1.5
            self.sigma = min(max(0.9 * self.sigma + 0.1 * spread, _SIGMA_LOW), _SIGMA_HIGH)

    def measure_misplacement(
        self, lab: NDArray[np.uint8], person: NDArray[np.uint8], windows: Sequence[Window]
    ) -> None:
        """
        Set ``misplacement`` to what a frame shows that is about to be judged, if enough tells.

        A camera that is knocked, or a film between whose frames something is missing, is off by
        more for one frame, in which all edges would be the person's.
        """
        parts = [np.empty(0, np.float32)]
        for window in windows:
            mean, above, below, before, after = (
                self._known(_sampled(window, down, across))[..., 0]
                for down, across in ((0, 0), (-1, 0), (1, 0), (0, -1), (0, 1))
            )
            slope, every = np.hypot(below - above, after - before) / 2, _sampled(window)
            steep = (slope >= _STEEP * self.sigma) & (person[every] == 0) & (mean >= 0)
            parts.append(np.abs(lab[every][steep, 0] - mean[steep]) / slope[steep])
        places = np.concatenate(parts)
        if len(places) >= LEAST_SAMPLES:
            misplaced = _OF_MEDIAN * float(median(places))
            misplaced = max(misplaced**2 - _NOISE_PLACE**2, 0.0) ** 0.5
            # A jolt counts at once, what drifts in the mean of some frames.
            jolt = misplaced > self.misplacement + _PLACE
            share = 1.0 if jolt else _PLACE
            self.misplacement += share * (misplaced - self.misplacement)

    def _known(self, part: Window) -> NDArray[np.float32]:
        """Return the mean of some pixels, (h, w, 3) float32, NaN where it is not known."""
        sums = self.sums[part]
        mean = np.asarray(sums[..., :3] / np.maximum(sums[..., 3:], np.float32(1)), np.float32)
        mean[sums[..., 3] < 1] = np.nan
        return mean


def _sampled(window: Window, down: int = 0, across: int = 0) -> Window:
    """Return some of the inner pixels of a window, or those so many rows and columns away."""
    rows, columns = window
    return (
        slice(rows.start + 1 + down, max(rows.stop - 1 + down, 0), _SAMPLE_STEP),
        slice(columns.start + 1 + across, max(columns.stop - 1 + across, 0), _SAMPLE_STEP),
    )


@kernel('f4[:,:,::1], u1[:,:,::1], u1[:,::1], i8, i8, i8, i8', fastmath=True, error_model='numpy')
def _update_sums(
    sums: NDArray[np.float32],
    lab: NDArray[np.uint8],
    person: NDArray[np.uint8],
    top: int,
    bottom: int,
    left: int,
    right: int,
) -> None:
    """Take in the pixels of a window; by lines, so that the distances in memory are known."""
    zero, one, most = np.float32(0), np.float32(1), np.float32(_MOST_COUNT)
    for row in range(top, bottom):
        line = sums[row].reshape(-1)[4 * left : 4 * right]
        pixels = lab[row].reshape(-1)[3 * left : 3 * right]
        hidden = person[row, left:right]
        for col in range(hidden.size):
            weight = one if hidden[col] == 0 else zero
            count = line[4 * col + 3] + weight
            keep = most / max(count, most)
            for channel in range(3):
                place = 4 * col + channel
                seen = weight * np.float32(pixels[3 * col + channel])
                line[place] = keep * (line[place] + seen)
            line[4 * col + 3] = keep * count


@kernel('f4[:,:,::1], u1[:,:,::1], f8, f8, f4[:,::1]', fastmath=True, error_model='numpy')
def _weigh(
    sums: NDArray[np.float32],
    lab: NDArray[np.uint8],
    sigma: float,
    shadow_floor: float,
    out: NDArray[np.float32],
) -> None:
    """
    Fill in log-odds that pixels are not the background, see :meth:`.evidence`.

    Without branches, so that many pixels are done at once.
    """
    one, zero = np.float32(1), np.float32(0)
    # Seen that often, though hidden for a time since.
    sure = np.float32(SURE_COUNT - 0.5)
    gain, neutral, limit = np.float32(_GAIN), np.float32(_NEUTRAL), np.float32(_LIMIT)
    scale, floor = np.float32(1 / (2 * sigma * sigma)), np.float32(shadow_floor)
    steepness, middle = np.float32(1 / max(1 - shadow_floor, 1e-6)), np.float32(128)
    for row in range(out.shape[0]):
        line, pixels, result = sums[row].reshape(-1), lab[row].reshape(-1), out[row]
        for col in range(result.size):
            count = line[4 * col + 3]
            share = one / max(count, sure)
            base, light = line[4 * col] * share, np.float32(pixels[3 * col])
            base_a, base_b = line[4 * col + 1] * share, line[4 * col + 2] * share
            a, b = np.float32(pixels[3 * col + 1]), np.float32(pixels[3 * col + 2])
            off_a, off_b, off = a - base_a, b - base_b, light - base
            chroma = off_a * off_a + off_b * off_b
            value = scale * (chroma + off * off) - neutral
            # A shadow takes colour away in proportion to the light, or leaves it.
            part = light / max(base, one)
            less_a, less_b = a - middle - part * (base_a - middle), b - middle
            less_b -= part * (base_b - middle)
            shaded = scale * min(chroma, less_a * less_a + less_b * less_b)
            shaded -= neutral * (one - (one - part) * steepness)
            shaded = min(value, shaded)
            value = shaded if (floor < part) & (part < one) else value
            value = min(max(gain * value, -limit), limit)
            result[col] = value if count >= sure else zero
