# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The still world as the search sees it: a running mean of each pixel of the canvas.

A pixel is background once it has been still; where nothing moves now, what was seen before
something moved there stays known.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import pixel_affine
from gait_segmentation.images import shift_whole
from gait_segmentation.kernels import kernel

__all__ = ['MotionBackground']

_LEAST_COUNT = 3
_MOST_COUNT = 16
_SHARE = np.array([65536 // (count + 1) + 1 for count in range(_MOST_COUNT + 1)], np.int32)
"""1 / (count + 1) in 65536ths, rounded up so that whole quotients stay whole."""

_PATIENCE_S, _SHORT_PATIENCE_S = 0.6, 0.3
"""How long something new must stay to become background, and where the background is young."""

_YOUNG_S = 1.8
"""
Time for which a pixel must have been seen not to be young: it may show somebody who was there
when the search began, and has left a place of which nothing is known.
"""

_USUAL_PERIOD_S = 0.04
_LEAST_FRAMES, _MOST_FRAMES = 3, 200
"""Time between two frames while it is not known, and the limits of times counted in frames."""

_SIGMA_START, _SIGMA_LOW, _SIGMA_HIGH = 4.0, 2.0, 12.0
_NOISE_STEP = 4
_DETECT = 4.0
"""Least difference that counts, in standard deviations of the noise."""

_UNKNOWN = 140
"""Likelihood where something moves before a background that has never been seen."""

_SHADOW = 0.6
"""Weight of a difference that a shadow could make."""

_PROBE, _PROBE_CUT = 3, 16.0
"""Distance of the pixels at which a motion of the camera is checked, in pixels, and the most
that one of them can say, in grey levels."""


@kernel('u1[:,:,::1], u1[:,:,::1], u1[:,::1], f8, i8, u1[:,::1]')
def _compare(
    colours: NDArray[np.uint8],
    state: NDArray[np.uint8],
    moving: NDArray[np.uint8],
    level: float,
    least: int,
    out: NDArray[np.uint8],
) -> None:
    """Write how surely each pixel is no background: 0 below 0.6 ``level``, 255 above 1.4."""
    scale = np.float32(255 / (0.8 * level))
    for row in range(colours.shape[0]):
        for col in range(colours.shape[1]):
            if state[row, col, 3] < least:
                out[row, col] = _UNKNOWN if moving[row, col] else 0
                continue
            light = np.int32(colours[row, col, 0]) - np.int32(state[row, col, 0])
            chroma = 0
            for channel in range(1, 3):
                chroma += abs(
                    np.int32(colours[row, col, channel]) - np.int32(state[row, col, channel])
                )
            total = np.float32(abs(light) + chroma)
            darker = light < 0 and -3 * light < np.int32(state[row, col, 0])
            if darker and chroma < 0.3 * level:
                # As a shadow changes it: by less than a third, of the same hue.
                total *= np.float32(_SHADOW)
            value = (total - np.float32(0.6 * level)) * scale
            out[row, col] = min(max(value, np.float32(0)), np.float32(255))


@kernel('u1[:,::1], u1[:,:,::1], u1[:,::1], f8[:,::1]')
def _mismatch(
    gray: NDArray[np.uint8],
    state: NDArray[np.uint8],
    keep: NDArray[np.uint8],
    motion: NDArray[np.float64],
) -> tuple[float, int, float, float, float, float, float]:
    """
    Compare an image with the background of a canvas that lies in it by a transform.

    :returns: the mean difference, cut; the number of pixels compared; and of those not cut the
        normal equations of the shift of the image that would mend it: A_xx, A_xy, A_yy, b_x, b_y.
    """
    height, width = gray.shape
    error, count = 0.0, 0
    xx, xy, yy, bx, by = 0.0, 0.0, 0.0, 0.0, 0.0
    for row in range(_PROBE, height - _PROBE, _PROBE):
        for col in range(_PROBE, width - _PROBE, _PROBE):
            # From the first frame on: a motion trusted blindly meanwhile would stay.
            if state[row, col, 3] == 0 or keep[row, col]:
                continue
            x = motion[0, 0] * (col + 0.5) + motion[0, 1] * (row + 0.5) + motion[0, 2] - 0.5
            y = motion[1, 0] * (col + 0.5) + motion[1, 1] * (row + 0.5) + motion[1, 2] - 0.5
            left, top = int(np.floor(x)), int(np.floor(y))
            if left < 0 or top < 0 or left + 1 >= width or top + 1 >= height:
                continue
            u, v = x - left, y - top
            above = (1 - u) * gray[top, left] + u * gray[top, left + 1]
            below = (1 - u) * gray[top + 1, left] + u * gray[top + 1, left + 1]
            rest = float(state[row, col, 0]) - ((1 - v) * above + v * below)
            count += 1
            error += min(abs(rest), _PROBE_CUT)
            if abs(rest) >= _PROBE_CUT:
                continue
            gx = 0.5 * (float(state[row, col + 1, 0]) - float(state[row, col - 1, 0]))
            gy = 0.5 * (float(state[row + 1, col, 0]) - float(state[row - 1, col, 0]))
            xx += gx * gx
            xy += gx * gy
            yy += gy * gy
            bx += gx * rest
            by += gy * rest
    return error / max(count, 1), count, xx, xy, yy, bx, by


@kernel('u1[:,:,::1], u1[:,::1], f8, i8, i8, i8, u1[:,:,::1], u1[:,:,::1]')
def _learn(
    colours: NDArray[np.uint8],
    keep: NDArray[np.uint8],
    level: float,
    patience: int,
    short_patience: int,
    young: int,
    state: NDArray[np.uint8],
    rival: NDArray[np.uint8],
) -> None:
    """Take a frame into the background, but for the pixels to keep."""
    for row in range(colours.shape[0]):
        for col in range(colours.shape[1]):
            if keep[row, col]:
                rival[row, col, 1] = 0
                continue
            count = np.int32(state[row, col, 3])
            total = 0
            for channel in range(3):
                total += abs(
                    np.int32(colours[row, col, channel]) - np.int32(state[row, col, channel])
                )
            if count == 0 or total < level:
                for channel in range(3):
                    old = np.int32(state[row, col, channel])
                    step = np.int32(colours[row, col, channel]) - old
                    # Rounded away from zero, so that small steps are not lost.
                    most = min(count, _MOST_COUNT)
                    part = ((abs(step) + most) * _SHARE[most]) >> 16
                    state[row, col, channel] = old + part if step > 0 else old - part
                state[row, col, 3] = min(count + 1, 255)
                rival[row, col, 1] = 0
                continue
            if abs(np.int32(colours[row, col, 0]) - np.int32(rival[row, col, 0])) < level:
                rival[row, col, 1] = min(np.int32(rival[row, col, 1]) + 1, 255)
            else:
                rival[row, col, 1] = 0
            rival[row, col, 0] = colours[row, col, 0]
            if rival[row, col, 1] >= (patience if count > young else short_patience):
                for channel in range(3):
                    state[row, col, channel] = colours[row, col, channel]
                state[row, col, 3] = _LEAST_COUNT
                rival[row, col, 1] = 0


class MotionBackground:
    """
    What each pixel of the canvas shows while nothing moves there.

    ``level`` is the least difference that counts, in grey levels, by the noise that is measured.
    """

    def __init__(self, shape: tuple[int, int]) -> None:
        """Know nothing of a canvas of the given (h, w)."""
        self._state = np.zeros((*shape, 4), np.uint8)
        self._rival = np.zeros((*shape, 2), np.uint8)
        self._sigma = _SIGMA_START

    @property
    def level(self) -> float:
        """Return the least difference that counts, in grey levels."""
        return _DETECT * self._sigma

    def compare(self, canvas: NDArray[np.uint8], moving: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """
        Return how surely each pixel is no background, (h, w) uint8.

        :param canvas: (h, w, 3) uint8, lightness first.
        :param moving: (h, w) uint8, non-zero where something moves now.
        """
        likelihood = np.empty(canvas.shape[:2], np.uint8)
        _compare(canvas, self._state, moving, 2 * self.level, _LEAST_COUNT, likelihood)
        return likelihood

    def mismatch(
        self, gray: NDArray[np.uint8], keep: NDArray[np.uint8], motion: NDArray[np.float64]
    ) -> tuple[float, int, float, float, float, float, float]:
        """
        Compare an image with the background of a canvas that lies in it by a transform.

        :param gray: (h, w) uint8 lightness.
        :param keep: (h, w) uint8, non-zero where something moved.
        :param motion: 2 x 3 transform of positions from the canvas to the image.
        :returns: the mean difference, cut; the number of pixels compared; and of those not cut
            the normal equations of the shift of the image that would mend it: A_xx, A_xy, A_yy,
            b_x, b_y.
        """
        return _mismatch(gray, self._state, keep, motion)

    def learn(
        self,
        canvas: NDArray[np.uint8],
        evidence: NDArray[np.uint8],
        keep: NDArray[np.uint8],
        period: float,
    ) -> None:
        """
        Take in a frame, and measure the noise where nothing stands out.

        :param canvas: (h, w, 3) uint8, lightness first.
        :param evidence: (h, w) uint8, non-zero where something stands out.
        :param keep: (h, w) uint8, non-zero where nothing is to be learnt.
        :param period: time between two frames in seconds, 0 if it is not known.
        """
        level = self.level
        self._measure_noise(canvas, evidence)
        times = [_frames(each, period) for each in (_PATIENCE_S, _SHORT_PATIENCE_S, _YOUNG_S)]
        _learn(canvas, keep, 2 * level, *times, self._state, self._rival)

    def _measure_noise(self, canvas: NDArray[np.uint8], evidence: NDArray[np.uint8]) -> None:
        part = slice(None, None, _NOISE_STEP)
        state = self._state[part, part]
        use = (evidence[part, part] == 0) & (state[:, :, 3] >= _LEAST_COUNT)
        if np.count_nonzero(use) < 50:
            return
        residual = cv2.absdiff(
            np.ascontiguousarray(canvas[part, part, 0]), np.ascontiguousarray(state[:, :, 0])
        )[use]
        spread = 1.4826 * float(residual.mean()) + 1.0
        self._sigma = float(np.clip(0.9 * self._sigma + 0.1 * spread, _SIGMA_LOW, _SIGMA_HIGH))

    def shift(self, dx: int, dy: int) -> None:
        """Move by whole pixels."""
        self._state = shift_whole(self._state, dx, dy)
        self._rival = shift_whole(self._rival, dx, dy)

    def warp(self, motion: NDArray[np.float64]) -> None:
        """Resample for a canvas that is laid anew by a 2 x 3 transform of positions."""
        size = self._state.shape[1::-1]
        self._state = cv2.warpAffine(
            self._state, pixel_affine(motion), size, flags=cv2.INTER_LINEAR
        )
        # At the rim it is mixed with nothing.
        full = np.full(self._state.shape[:2], 255, np.uint8)
        inside = cv2.warpAffine(full, pixel_affine(motion), size, flags=cv2.INTER_LINEAR)
        self._state[inside < 255] = 0
        self._rival = np.zeros_like(self._rival)


def _frames(seconds: float, period: float) -> int:
    """Return how many frames last for a time."""
    frames = round(seconds / (period if period > 0 else _USUAL_PERIOD_S))
    return min(max(frames, _LEAST_FRAMES), _MOST_FRAMES)
