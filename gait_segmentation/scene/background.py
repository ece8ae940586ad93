# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the surroundings look like pixel by pixel, moved along with the camera's motion."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.colour import NO_CHROMA, gray_lab
from gait_segmentation.images import Window, median
from gait_segmentation.kernels import kernel
from gait_segmentation.scene.ego_motion import WorldMotion
from gait_segmentation.scene.relight import relight

_LEAST_RATE = 0.04  # share of a frame in the mean of a pixel that was seen often
_HIDDEN_DECAY = 0.995  # of the count of a pixel that is hidden, in each frame
_WARP_DECAY = 0.98  # of all counts in each motion
SURE_COUNT = 2.0  # times a pixel was seen to be sure what is there
_SAMPLE_STEP = 3  # rows and columns from one pixel that is measured to the next
_LEAST_SAMPLES = 50  # fewer pixels do not tell
# Half the squared distance in ``sigma`` that says nothing, evidence per step, and its limit, which
# is reached four ``sigma`` away.
_NEUTRAL = 4.0
_EVIDENCE_GAIN = 0.75
_MOST_EVIDENCE_OF_PIXEL = 3.0
_STEEP_SLOPE = 4.0  # per pixel, in ``sigma``, from which residuals tell of a wrong place
_NOISE_PLACE = 0.25  # what noise alone makes of steep pixels, in pixels
_PLACE_RATE = 0.5
# Pixels by which a frame must be off more than those before to be a jolt: more than drift.
_JOLT = 0.5
# Standard deviation of normal residuals over the median of their absolute values.
_OF_MEDIAN = 1.4826
_SIGMA_START = 5.0
_SIGMA_LOW = 2.5
_SIGMA_HIGH = 14.0


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

    def within(self, window: Window, lab: NDArray[np.uint8] | None = None) -> BackgroundModel:
        """
        Return the model of a window alone, as it is or in the light of a frame.

        :param lab: (h, w, 3) uint8, the window of that frame; see :mod:`.scene.relight`.
        """
        sums = np.ascontiguousarray(self.sums[window])
        return self.with_sums(sums if lab is None else relight(sums, lab, self.sigma))

    def contradicted(self, lab: NDArray[np.uint8], shadow_floor: float) -> NDArray[np.uint8]:
        """Return where the :meth:`evidence` is sure not to be the background, (h, w) uint8 0/1."""
        strange = self._weighed(lab, shadow_floor) >= _MOST_EVIDENCE_OF_PIXEL
        return (strange & self.is_sure).view(np.uint8)

    def confirmed(self, lab: NDArray[np.uint8], shadow_floor: float) -> NDArray[np.uint8]:
        """Return where it is sure and not :meth:`contradicted`, (h, w) uint8 0/1."""
        return (self.is_sure & (self.contradicted(lab, shadow_floor) == 0)).view(np.uint8)

    def evidence(self, lab: NDArray[np.uint8], shadow_floor: float) -> NDArray[np.float32]:
        """
        Return log-odds that pixels are not the background, (h, w) float32 within +-3.

        They are 0 where it is not known.  What is a little darker and of the same chroma is hardly
        clothes of just that colour; the darker a shadow would be, the less is said.

        :param shadow_floor: darkest shadow, as a share of the lightness.
        """
        return self._weighed(lab, shadow_floor) * (self.count / (self.count + 1))

    def _weighed(self, lab: NDArray[np.uint8], shadow_floor: float) -> NDArray[np.float32]:
        """Return the evidence however often pixels were seen, if they are known at all."""
        out = np.empty(lab.shape[:2], np.float32)
        _weigh_background(self.sums, lab, self.sigma, shadow_floor, out)
        return out

    def agreement(
        self, lab: NDArray[np.uint8], person: NDArray[np.uint8], windows: Sequence[Window]
    ) -> float:
        """Return the share of what is sure to be there that a frame shows, 1 if few tell."""
        total = other = 0
        for window in windows:
            every = _some_of(window)
            free, here = person[every] == 0, self.within(every)
            strange = here.contradicted(np.ascontiguousarray(lab[every]), 1.0)
            total += np.count_nonzero(here.is_sure & free)
            other += np.count_nonzero(strange & free)
        return 1 - other / total if total >= _LEAST_SAMPLES else 1.0

    @property
    def is_sure(self) -> NDArray[np.bool_]:
        """Return which pixels were seen often enough to be sure, (h, w)."""
        return self.count >= np.float32(SURE_COUNT)

    def forget(self, where: NDArray[np.uint8] | NDArray[np.bool_], kept: float = 0.0) -> None:
        """Forget the pixels where an image, (h, w), is not zero, but for a share of the count."""
        self.sums[where > 0] *= kept

    def fade(self, textured: bool) -> None:
        """Go on as if all had been grey, as light; with ``textured`` gradients are its colours."""
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

    def with_sums(self, sums: NDArray[np.float32]) -> BackgroundModel:
        """Return a model as sure of itself, with other sums."""
        other = BackgroundModel((0, 0))
        other.sums, other.sigma, other.misplacement = sums, self.sigma, self.misplacement
        return other

    def resized(self, shape: tuple[int, int]) -> BackgroundModel:
        """Return the model for a working image of another (h, w)."""
        smaller = shape[0] < self.sums.shape[0]
        way = cv2.INTER_AREA if smaller else cv2.INTER_LINEAR
        return self.with_sums(np.asarray(cv2.resize(self.sums, shape[::-1], interpolation=way)))

    def moved(
        self, steps: Sequence[WorldMotion], windows: Sequence[Window] | None = None
    ) -> BackgroundModel:
        """Return the model after motions of the world, oldest first; this one if it stays."""
        moves = sum(step.camera is not None for step in steps)
        if moves == 0:
            return self
        other = self.with_sums(np.zeros_like(self.sums))
        motion, decay = WorldMotion.over(steps), np.float32(_WARP_DECAY**moves)
        for window in self._all if windows is None else windows:
            # Linear interpolation, frame after frame, would take the contrast out of fine stripes,
            # which then differ from every new frame.
            part = motion.warped(self.sums, window, cv2.BORDER_CONSTANT, cv2.INTER_CUBIC)
            np.multiply(np.maximum(part, 0, out=part), decay, out=other.sums[window])
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
        for part in self._all if windows is None else windows:
            _update_sums(self.sums, lab, person, *_bounds(part))

    def measure_noise(
        self, lab: NDArray[np.uint8], person: NDArray[np.uint8], windows: Sequence[Window]
    ) -> None:
        """Update ``sigma`` and ``misplacement`` by a frame that is not learnt yet."""
        residuals, misplaced = self._measured(lab, person, windows)
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
        """
        _, misplaced = self._measured(lab, person, windows)
        if misplaced is not None and misplaced > self.misplacement + _JOLT:
            self.misplacement = misplaced

    def _measured(
        self, lab: NDArray[np.uint8], person: NDArray[np.uint8], windows: Sequence[Window]
    ) -> tuple[NDArray[np.float32], float | None]:
        """Return by how many levels parts of a frame are off, and by how many pixels all is."""
        size = sum(self.sums[_some_of(window)].size for window in windows)
        residuals, places = np.empty(size, np.float32), np.empty(size, np.float32)
        found = steeps = 0
        for window in windows:
            more, steeper = _sample_residuals(
                self.sums,
                lab,
                person,
                *_bounds(window),
                _STEEP_SLOPE * self.sigma,
                residuals[found:],
                places[steeps:],
            )
            found, steeps = found + more, steeps + steeper
        if found < 3 * _LEAST_SAMPLES:
            return residuals[:0], None
        if steeps < _LEAST_SAMPLES:
            return residuals[:found], None
        misplaced = _OF_MEDIAN * float(median(places[:steeps]))
        return residuals[:found], max(misplaced**2 - _NOISE_PLACE**2, 0.0) ** 0.5


def _some_of(window: Window) -> Window:
    """Return the rows and columns of a window that are measured."""
    top, bottom, left, right = _bounds(window)
    return slice(top, bottom, _SAMPLE_STEP), slice(left, right, _SAMPLE_STEP)


def _bounds(window: Window) -> tuple[int, int, int, int]:
    """Return the first row and the one after the last, and the same of the columns."""
    rows, columns = window
    return rows.start, rows.stop, columns.start, columns.stop


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
    decay, zero, one = np.float32(_HIDDEN_DECAY), np.float32(0), np.float32(1)
    rate, most = np.float32(_LEAST_RATE), np.float32(1 / _LEAST_RATE)
    few = np.float32(1 / _LEAST_RATE - 1)
    for row in range(top, bottom):
        line = sums[row].reshape(-1)[4 * left : 4 * right]
        pixels = lab[row].reshape(-1)[3 * left : 3 * right]
        hidden = person[row, left:right]
        for col in range(hidden.size):
            count = line[4 * col + 3]
            slow = count > few
            after = min(count + one, most)
            keep = (one - rate) * after / max(count, few) if slow else one
            gain = rate * after if slow else one
            if hidden[col] != 0:
                keep, gain = decay, zero
            for channel in range(3):
                place = 4 * col + channel
                line[place] = keep * line[place] + gain * np.float32(pixels[3 * col + channel])
            line[4 * col + 3] = keep * count + gain


@kernel(
    'f4[:,:,::1], u1[:,:,::1], u1[:,::1], i8, i8, i8, i8, f8, f4[::1], f4[::1]',
    error_model='numpy',
)
def _sample_residuals(
    sums: NDArray[np.float32],
    lab: NDArray[np.uint8],
    person: NDArray[np.uint8],
    top: int,
    bottom: int,
    left: int,
    right: int,
    steep: float,
    residuals: NDArray[np.float32],
    places: NDArray[np.float32],
) -> tuple[int, int]:
    """Collect residuals, and those of lightness over steep slopes; return how many."""
    # Without branches: what does not count is written over by what comes next.
    found = steeps = 0
    one, least = np.float32(1), np.float32(steep * steep)
    for row in range(top, bottom, _SAMPLE_STEP):
        above, below = max(row - 1, top), min(row + 1, bottom - 1)
        for col in range(left, right, _SAMPLE_STEP):
            before, after = max(col - 1, left), min(col + 1, right - 1)
            count = sums[row, col, 3]
            for channel in range(3):
                mean = sums[row, col, channel] / count
                residuals[found + channel] = abs(np.float32(lab[row, col, channel]) - mean)
            up, low = sums[above, col, 3], sums[below, col, 3]
            near, far = sums[row, before, 3], sums[row, after, 3]
            down = (sums[below, col, 0] / low - sums[above, col, 0] / up) / 2
            across = (sums[row, after, 0] / far - sums[row, before, 0] / near) / 2
            square = np.float32(down * down + across * across)
            places[steeps] = residuals[found] / np.sqrt(square)
            known = (person[row, col] == 0) & (count >= one)
            inner = (above < row) & (row < below) & (before < col) & (col < after)
            found += 3 * known
            around = min(min(up, low), min(near, far)) >= one
            steeps += known & inner & around & (square >= least)
    return found, steeps


@kernel('f4[:,:,::1], u1[:,:,::1], f8, f8, f4[:,::1]', fastmath=True, error_model='numpy')
def _weigh_background(
    sums: NDArray[np.float32],
    lab: NDArray[np.uint8],
    sigma: float,
    shadow_floor: float,
    out: NDArray[np.float32],
) -> None:
    """Fill in log-odds of not being background."""
    one, zero = np.float32(1), np.float32(0)
    # Seen that often, though hidden for a time since.
    sure = np.float32(SURE_COUNT - 0.5)
    gain, neutral = np.float32(_EVIDENCE_GAIN), np.float32(_NEUTRAL)
    limit = np.float32(_MOST_EVIDENCE_OF_PIXEL)
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
