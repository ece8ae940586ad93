# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The working image, shared by all cues: scaled down once, in Lab, as the first light showed it.

Exposure, white balance and lamps that flicker multiply the levels of a channel, all over the image
or by rows, as a rolling shutter reads them.  The factors are measured against what the still
world is remembered to look like, not against the last frame, so that slow changes add up as jumps
do, and errors do not.

In the dark, in haze and behind glass pictures use few of the 256 levels.  The bins of histograms
and the least noise that models allow for are made for pictures that use many of them: such levels
are spread.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.colour import gray_lab, is_gray
from gait_segmentation.images import Window, median, shrink
from gait_segmentation.scene.background import BackgroundModel
from gait_segmentation.scene.ego_motion import LEAST_RANGE, Pyramid, WorldMotion

_CELL = 8  # pixels across what is compared: noise and small motions count little in it
_DARKEST = 12  # levels from black or white within which a cell may be clipped
_LEAST_CELLS = 50  # cells that tell the light; fewer may be one surface, which somebody hides
# Share of the cells that must have changed by the same factor, give or take this (as a log).
_AGREE = 0.6
_SAME_FACTOR = 0.15
# Least correlation of the levels of cells that show the same place, even through bands.
_CORRELATION = 0.3
# Change (as a log) that is left to the models: two levels of 100, as the noise they allow.
_UNNOTICED = 0.02
# Periods of flicker in the image: a shutter reads it in 10 to 30 ms, lamps flicker at 100 Hz.
# Less than a period is not told from a shade.
_PERIODS = np.arange(1, 3.01, 0.125)
# Weights of blue, green and red in the brightness, as OpenCV has them.
_GRAY = np.array([0.114, 0.587, 0.299], np.float32)
_LEFT_OUT = 0.005  # share of the levels at either end that does not count
_FULL = 128.0  # levels that a picture which needs no spreading uses at least
_MOST_SPREAD = 4.0  # largest factor; beyond it noise is most of what is spread
_Floats = NDArray[np.float32]
_Wave = tuple[float, float, float]


class Light:
    """
    Follows the light of a stream, so that all frames look as the first one did.

    ``wave`` is that of the logs of the factors down the image: its periods, and its amplitudes as
    cosine and sine; None if the light does not flicker, or is not to (``flickers``).  ``faded``
    says that the frames have no colour, as at night, although earlier ones had.
    """

    def __init__(self) -> None:
        self.wave: _Wave | None = None
        self.faded = False
        self.flickers = True
        self._coloured = False
        self._logs = np.zeros(3, np.float32)
        self._known = BackgroundModel((0, 0))
        self._people = self._strange = np.zeros((0, 0), np.bool_)
        self._now: NDArray[np.uint8] | None = None

    @property
    def gain(self) -> _Floats:
        """Return what the levels of blue, green and red must be multiplied with, (3,) float32."""
        return np.exp(self._logs)

    def measure(self, image: NDArray[np.uint8], *, gray: bool = False) -> None:
        """Take in a frame, (h, w, 3) uint8 BGR; ``gray`` if its channels are all the same."""
        rows, columns = (max(size // _CELL, 1) for size in image.shape[:2])
        part = image[: rows * _CELL, : columns * _CELL]
        cells = np.asarray(cv2.resize(part, (columns, rows), interpolation=cv2.INTER_AREA))
        self._now = None
        if np.ptp(cells @ _GRAY) >= LEAST_RANGE:
            self._coloured |= not gray
            self.faded = gray and self._coloured
            self._measure(cells)
            self._now = self.undone(cells)

    def follow(self, motion: WorldMotion, people: NDArray[np.uint8]) -> None:
        """Remember the newest frame, moved on, but for people: non-zero in (h, w) uint8."""
        if self._now is None:
            return
        now, self._now = self._now, None
        if motion.camera is not None:
            self._known = self._known.moved([motion.scaled(1 / _CELL, 1 / _CELL)])
        hidden = (people > 0).view(np.uint8) * 255
        hidden = np.asarray(cv2.resize(hidden, now.shape[1::-1], interpolation=cv2.INTER_AREA))
        self._people = hidden > 0
        if not self.faded:
            # An unknown person, say: the place is not forgotten at once.
            hidden[self._strange] = 255
            self._known.add(now, hidden)

    def forget(self) -> None:
        """Forget the place, for the camera shows another one from now on, in the same light."""
        self._known.sums[:] = 0

    def _measure(self, cells: NDArray[np.uint8]) -> None:
        """Measure the light of a frame, (h, w, 3) uint8."""
        self.wave, shape = None, (cells.shape[0], cells.shape[1])
        if self._known.sums.shape[:2] != shape:
            known = self._known
            self._known = known.resized(shape) if known.sums.size else BackgroundModel(shape)
            self._people = np.zeros(shape, np.bool_)
        mean, now = self._known.mean, cells.astype(np.float32)
        bright, bright_now = mean @ _GRAY, now @ _GRAY
        if self.faded:
            mean = np.repeat(bright[..., None], 3, axis=2)
            self._logs[:] = self._logs @ _GRAY
        self._strange = _visible(bright) & _visible(bright_now)
        use = self._strange & ~self._people
        if np.count_nonzero(use) < _LEAST_CELLS:
            return
        pair = bright[use][None], bright_now[use][None]
        if cv2.matchTemplate(*pair, cv2.TM_CCOEFF_NORMED)[0, 0] < _CORRELATION:
            return
        shade, logs = _log_ratios(bright, bright_now), _log_ratios(mean, now)
        # Against the brightness, as what is not quite in place changes both.
        tints = logs - shade[..., None]
        self.wave = _wave_in(shade, use) if self.flickers else None
        if self.wave is not None:
            shade -= _along(self.wave, shape[0])[:, None]
        near = use & (np.abs(shade - median(shade[use])) < _SAME_FACTOR)
        if np.count_nonzero(near) > _AGREE * np.count_nonzero(use):
            # Those that agree once more: what covers a part of the world is on one side of it.
            total = median(shade[near]) + median(tints[near])
            if np.abs(total - self._logs).max() > _UNNOTICED:
                # All of it, so that what is left out does not add up in what is remembered.
                self._logs = total.astype(np.float32)
        self._strange &= np.abs(shade - self._logs @ _GRAY) > _SAME_FACTOR

    def undone(self, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return an image of the newest frame, (h, w, 3) uint8, in the first light."""
        if self.wave is None and not self._logs.any():
            return image
        if self.wave is None:
            table = np.minimum(np.arange(256, dtype=np.float32)[:, None] * self.gain, 255)
            return np.asarray(cv2.LUT(image, np.rint(table).astype(np.uint8)[None]))
        factors = np.exp(_along(self.wave, image.shape[0]))[:, None, None] * self.gain
        every = cv2.resize(factors, image.shape[1::-1], interpolation=cv2.INTER_NEAREST)
        return np.asarray(cv2.multiply(image, every, dtype=cv2.CV_8U))


class Contrast:
    """Spreads the levels of a stream as its first picture needs it, so that models stay valid."""

    def __init__(self) -> None:
        self._curve: NDArray[np.uint8] | None = None
        self._known = False

    def curve_for(self, image: NDArray[np.uint8]) -> NDArray[np.uint8] | None:
        """
        Return the curve that spreads the levels of a picture, (256,) uint8, None if it needs none.

        Only the first, (h, w, 3) uint8, is looked at.  What lies outside of the levels that count
        is squeezed, but stays apart: later pictures of the stream may use it.
        """
        if self._known:
            return self._curve
        self._known = True
        share = np.cumsum(np.bincount(image.reshape(-1), minlength=256)) / image.size
        low, high = (int(level) for level in np.searchsorted(share, (_LEFT_OUT, 1 - _LEFT_OUT)))
        span = high - low
        wanted = min(_FULL, _MOST_SPREAD * span)
        if span < wanted:
            # The rest is shared out as it was, so that black stays black and white stays white.
            bottom = (255 - wanted) * low / (255 - span)
            ends = (0, bottom, bottom + wanted, 255)
            levels = np.interp(np.arange(256), (0, low, high, 255), ends)
            self._curve = np.round(levels).astype(np.uint8)
        return self._curve


def _visible(levels: _Floats) -> NDArray[np.bool_]:
    """Return which levels are known, and not clipped."""
    return (levels > _DARKEST) & (levels < 255 - _DARKEST)


def _log_ratios(known: _Floats, now: _Floats) -> _Floats:
    """Return the logs of known over present levels, of which those that are too dark are alike."""
    return np.log(np.maximum(known, _DARKEST) / np.maximum(now, _DARKEST))


def _wave_in(logs: _Floats, use: NDArray[np.bool_]) -> _Wave | None:
    """Return the wave in the logs of gains (h, w) down the image, None if there is none."""
    # Lamps flicker on the left as on the right: what changes on one side only leaves as much that
    # a wave does not tell as it tells.  A column in the middle is on both sides: none is empty.
    middle = logs.shape[1] // 2
    medians = []
    for side in (np.s_[:, : middle + 1], np.s_[:, middle:]):
        ordered = np.sort(np.where(use[side], logs[side], np.float32(np.nan)), axis=1)
        halves = np.count_nonzero(use[side], axis=1, keepdims=True) // 2
        medians.append(np.take_along_axis(ordered, halves, axis=1)[:, 0])
    values = np.concatenate(medians)
    told = ~np.isnan(values)
    if 2 * np.count_nonzero(told) < told.size:
        return None
    values = values[told].astype(np.float64)
    if np.std(values) < 2 * _UNNOTICED:
        return None
    places = np.tile((np.arange(logs.shape[0]) + 0.5) / logs.shape[0], 2)[told]
    angles = 2 * math.pi * _PERIODS[:, None] * places
    bases = np.stack([np.ones_like(angles), np.cos(angles), np.sin(angles)], axis=2)
    # Of each period what is left of the values beside the plane of its basis.
    within = np.square(values @ np.linalg.qr(bases).Q).sum(axis=1)
    best = int(np.argmax(within))
    rest = (float(values @ values) - float(within[best])) / len(values)
    _, cosine, sine = np.linalg.lstsq(bases[best], values, rcond=None)[0].tolist()
    return (float(_PERIODS[best]), cosine, sine) if (cosine**2 + sine**2) / 2 > rest else None


def _along(wave: _Wave, height: int) -> _Floats:
    """Return a wave at the rows of an image, (height,) float32."""
    periods, cosine, sine = wave
    angles = (2 * math.pi * periods / height) * (np.arange(height) + 0.5)
    return (cosine * np.cos(angles) + sine * np.sin(angles)).astype(np.float32)


@dataclass(frozen=True)
class WorkingImage:
    """
    One frame at working size.

    ``bgr`` is (h, w, 3) uint8, ``gray`` its brightness, (h, w) uint8, with which ``pyramid``
    begins; ``textured`` says that it has no colour and shows gradient energy in the place of a*
    and b* (:func:`.gray_lab`); ``faded`` that it has none although earlier ones had.
    """

    stamp_ns: int
    bgr: NDArray[np.uint8]
    gray: NDArray[np.uint8]
    pyramid: Pyramid
    textured: bool
    faded: bool = False

    @classmethod
    def of(
        cls,
        image: NDArray[np.uint8],
        stamp_ns: int,
        shape: tuple[int, int],
        light: Light | None = None,
        contrast: Contrast | None = None,
        *,
        texture: bool = True,
        measure: bool = True,
    ) -> WorkingImage:
        """
        Scale a frame.

        :param image: (H, W, 3) uint8 BGR.
        :param shape: (h, w) of the working image.
        :param light: which is undone, as the contrast is spread, if any.
        :param texture: whether gradient energy stands for colours that there are not.
        :param measure: whether the light is measured by it, or has been by the same frame.
        """
        small = shrink(image, shape)
        if small is image:
            # Lab comes later, when the caller may have filled its buffer anew.
            small = image.copy()
        colourless, faded = is_gray(small), False
        if light is not None:
            # First, as light is a factor only of the levels as they came.
            if measure:
                light.measure(small, gray=colourless)
            small, faded = light.undone(small), light.faded
        gray = np.asarray(cv2.cvtColor(small, cv2.COLOR_BGR2GRAY))
        curve = None if contrast is None else contrast.curve_for(small)
        if curve is not None:
            # Not of the colours with other levels, which would take three times as long.
            gray, small = (np.asarray(cv2.LUT(each, curve)) for each in (gray, small))
        textured = texture and colourless
        return cls(stamp_ns, small, gray, Pyramid(gray), textured, faded)

    @cached_property
    def lab(self) -> NDArray[np.uint8]:
        """Return the image in CIE L*a*b* as OpenCV stores it, (h, w, 3) uint8."""
        if self.textured:
            return gray_lab(self.gray)
        return np.asarray(cv2.cvtColor(self.bgr, cv2.COLOR_BGR2Lab))

    def lab_part(self, window: Window) -> NDArray[np.uint8]:
        """Return a window in Lab, (h, w, 3) uint8, its rows contiguous as kernels want them."""
        return np.ascontiguousarray(self.lab[window])


def working_scale(
    height: int, width: int, *, working_size: int, person_height: float, working_height: int
) -> float:
    """Return the factor from source to working size, at most 1 (small people stay as they are)."""
    scale = min(1.0, working_height / person_height)
    if working_size > 0:
        scale = min(scale, working_size / max(height, width))
    return scale


def working_shape(height: int, width: int, scale: float) -> tuple[int, int]:
    """Return (h, w) of the working image of a source of the given size."""
    return max(1, round(height * scale)), max(1, round(width * scale))
