# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
What moves against the world, without an empty scene to begin with.

Images are laid onto a canvas that follows the camera by whole pixels, so that the background is
never interpolated.  A pixel is background once it has been still; where nothing moves now, what
was seen before something moved there stays known, so that a walker stands out as soon as he has
moved on by his own width, also if he was there in the first frame.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.geometry import compose, invert, pixel_affine, scaling
from gait_segmentation.images import shift_whole
from gait_segmentation.starting.motion_blobs import Blob, find_blobs
from gait_segmentation.tracking.ego_motion import MotionEstimator

__all__ = ['MotionScene', 'SceneFrame']

_GAP_S = 0.14
"""Time between the two frames whose difference shows what moves now."""

_MOST_FRAMES = 32
_LEAST_COUNT = 3
_MOST_COUNT = 16
_SHARE = np.array([65536 // (count + 1) + 1 for count in range(_MOST_COUNT + 1)], np.int32)
"""1 / (count + 1) in 65536ths, rounded up so that whole quotients stay whole."""

_PATIENCE_S = 0.6
"""How long something new must stay to become background."""

_SIGMA_START, _SIGMA_LOW, _SIGMA_HIGH = 4.0, 2.0, 12.0
_NOISE_STEP = 4
_DETECT = 4.0
"""Least difference that counts, in standard deviations of the noise."""

_UNKNOWN = 140
"""Likelihood where something moves before a background that has never been seen."""

_SHADOW = 0.6
"""Weight of a difference that a shadow could make."""

_SLACK_PX = 1.0
"""Residual rotation and zoom at the corners above which the canvas is laid anew."""

_BROKEN = 0.5
"""Share of pixels that differ at which the world is not the one learnt."""

_PROBE, _LEAST_PROBES, _PROBE_CUT = 3, 100, 16.0
"""Distance of the pixels at which a motion of the camera is checked, in pixels; how many there
must be, and the most that one of them can say, in grey levels."""

_LEAST_TEXTURE = 0.25
"""Least product of the background's mean squared gradients that tells a shift."""

_STILL_PX = 0.1

_EDGE_PX = 2
"""Rim of a shifted frame that is not compared."""

_IDENTITY = scaling(1.0)


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
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
            if state[row, col, 3] < _LEAST_COUNT or keep[row, col]:
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


@njit(cache=True, nogil=True)
def _learn(
    colours: NDArray[np.uint8],
    keep: NDArray[np.uint8],
    level: float,
    patience: int,
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
                    part = ((abs(step) + count) * _SHARE[count]) >> 16
                    state[row, col, channel] = old + part if step > 0 else old - part
                state[row, col, 3] = min(count + 1, _MOST_COUNT)
                rival[row, col, 1] = 0
                continue
            if abs(np.int32(colours[row, col, 0]) - np.int32(rival[row, col, 0])) < level:
                rival[row, col, 1] = min(np.int32(rival[row, col, 1]) + 1, 255)
            else:
                rival[row, col, 1] = 0
            rival[row, col, 0] = colours[row, col, 0]
            if rival[row, col, 1] >= patience:
                for channel in range(3):
                    state[row, col, channel] = colours[row, col, channel]
                state[row, col, 3] = _LEAST_COUNT
                rival[row, col, 1] = 0


@dataclass
class _Recent:
    """The lightness of a frame, and by how much the canvas has moved since."""

    seconds: float
    gray: NDArray[np.uint8]
    offset: tuple[int, int] = (0, 0)


@dataclass(frozen=True)
class SceneFrame:
    """
    What moves in one frame, on the canvas.

    ``likelihood`` is (h, w) uint8, 255 = surely no background.  ``blobs`` are what hangs
    together.  ``shift`` is by how many whole pixels the canvas moved since the last frame: a
    point of the still world at (x, y) is now at (x + dx, y + dy).  ``to_image`` is the 2 x 3
    transform of positions from the canvas to the small image, ``step`` that from the last small
    image to this one, None for the identity.  ``hidden`` is (h, w) uint8, non-zero where the
    background cannot be seen.  ``fresh`` says that what was known before no longer holds.
    """

    likelihood: NDArray[np.uint8]
    blobs: list[Blob]
    shift: tuple[int, int]
    to_image: NDArray[np.float64]
    step: NDArray[np.float64] | None
    hidden: NDArray[np.uint8]
    fresh: bool


class MotionScene:
    """Learns the still world behind a camera that may move, and shows what moves before it."""

    def __init__(self, shape: tuple[int, int]) -> None:
        """Make a scene of which nothing is known, for images of the given (h, w)."""
        self._shape = shape
        self._estimator = MotionEstimator()
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._estimator.reset()
        self._forget()

    def _forget(self) -> None:
        height, width = self._shape
        self._state = np.zeros((height, width, 4), np.uint8)
        self._rival = np.zeros((height, width, 2), np.uint8)
        self._to_image: NDArray[np.float64] = _IDENTITY
        self._last_step: NDArray[np.float64] | None = None
        self._recent: deque[_Recent] = deque()
        self._keep = np.zeros((height, width), np.uint8)
        self._sigma = _SIGMA_START

    def update(self, colours: NDArray[np.uint8], seconds: float) -> SceneFrame:
        """
        Take in a frame.

        :param colours: (h, w, 3) uint8 of the scene's size, lightness first, then two of chroma.
        :param seconds: its time, later than the last frame's.
        """
        gray = np.ascontiguousarray(colours[:, :, 0])
        camera = self._estimator.update(gray, self._keep, None).camera
        total = self._register(gray, camera)
        moved = total is not self._to_image
        self._last_step = compose(total, invert(self._to_image)) if moved else None
        shift = self._follow(total)
        canvas = cv2.blur(self._laid(colours), (3, 3))
        moving, frames = self._moving(np.ascontiguousarray(canvas[:, :, 0]), seconds)
        level = _DETECT * self._sigma
        likelihood = np.empty(self._shape, np.uint8)
        _compare(canvas, self._state, moving, 2 * level, _LEAST_COUNT, likelihood)
        _, evidence = cv2.threshold(likelihood, 127, 255, cv2.THRESH_BINARY)
        evidence = cv2.bitwise_or(evidence, moving)
        fresh = cv2.countNonZero(evidence) > _BROKEN * evidence.size
        if fresh:
            self._forget()
            evidence[:] = 0
            likelihood[:] = 0
        blobs, filled = find_blobs(evidence, moving)
        self._measure_noise(canvas, evidence)
        _learn(canvas, filled, 2 * level, max(3, frames), self._state, self._rival)
        self._keep = filled
        hidden = cv2.bitwise_or(filled, evidence)
        return SceneFrame(likelihood, blobs, shift, self._to_image, self._last_step, hidden, fresh)

    def _register(
        self, gray: NDArray[np.uint8], camera: NDArray[np.float64] | None
    ) -> NDArray[np.float64]:
        """
        Return where the canvas lies in this frame, as a transform of positions to the image.

        The camera moved as measured, as the last time, or not at all, whichever explains the
        background best; steps of Gauss and Newton towards it keep errors from adding up.
        """
        smooth = cv2.blur(gray, (3, 3))
        best, motion = None, self._to_image
        for guess in (None, camera, self._last_step):
            total = self._to_image if guess is None else compose(guess, self._to_image)
            if best is None or guess is not None:
                found = _mismatch(smooth, self._state, self._keep, total)
                if best is None or found[0] < best[0]:
                    best, motion = found, total
        assert best is not None
        _, count, xx, xy, yy, x, y = best
        if count < _LEAST_PROBES:
            return self._to_image if camera is None else compose(camera, self._to_image)
        determinant = xx * yy - xy * xy
        if determinant > _LEAST_TEXTURE * (count * count):
            dx = min(max((yy * x - xy * y) / determinant, -1.0), 1.0)
            dy = min(max((xx * y - xy * x) / determinant, -1.0), 1.0)
            if math.hypot(dx, dy) > _STILL_PX:
                motion = compose(np.array([[1.0, 0.0, dx], [0.0, 1.0, dy]]), motion)
        return motion

    def _follow(self, total: NDArray[np.float64]) -> tuple[int, int]:
        """Move the canvas with the camera by whole pixels."""
        if total is self._to_image:
            return 0, 0
        height, width = self._shape
        corners = np.array([[0.0, width, 0.0, width], [0.0, 0.0, height, height]])
        moved = total[:, :2] @ corners + total[:, 2:] - corners
        middle = moved.mean(axis=1)
        if float(np.abs(moved - middle[:, None]).max()) > _SLACK_PX:
            self._warp(total)
            self._to_image = _IDENTITY
            return round(float(middle[0])), round(float(middle[1]))
        dx, dy = round(float(middle[0])), round(float(middle[1]))
        self._to_image = total.copy()
        if dx or dy:
            # The canvas then lies by (dx, dy) further to the right and down in the world.
            self._state = shift_whole(self._state, dx, dy)
            self._rival = shift_whole(self._rival, dx, dy)
            for old in self._recent:
                old.offset = old.offset[0] + dx, old.offset[1] + dy
            self._to_image = compose(total, np.array([[1.0, 0, -dx], [0, 1.0, -dy]]))
        return dx, dy

    def _warp(self, motion: NDArray[np.float64]) -> None:
        """Resample all that is known for a canvas that is laid anew."""
        size = self._shape[::-1]
        matrix = pixel_affine(motion)
        self._state = cv2.warpAffine(self._state, matrix, size, flags=cv2.INTER_LINEAR)
        self._rival = np.zeros_like(self._rival)
        for old in self._recent:
            dx, dy = old.offset
            moved = compose(motion, np.array([[1.0, 0, dx], [0, 1.0, dy]]))
            old.offset = round(float(moved[0, 2])), round(float(moved[1, 2]))

    def _laid(self, colours: NDArray[np.uint8]) -> NDArray[np.uint8]:
        if self._to_image is _IDENTITY:
            return colours
        return np.asarray(
            cv2.warpAffine(
                colours,
                pixel_affine(invert(self._to_image)),
                self._shape[::-1],
                flags=cv2.INTER_LINEAR,
                borderMode=cv2.BORDER_REPLICATE,
            )
        )

    def _moving(self, gray: NDArray[np.uint8], seconds: float) -> tuple[NDArray[np.uint8], int]:
        """Return where something moves now, 0/255, and the frames of the patience."""
        recent = self._recent
        recent.append(_Recent(seconds, gray))
        while len(recent) > 2 and (
            seconds - recent[1].seconds >= _GAP_S or len(recent) > _MOST_FRAMES
        ):
            recent.popleft()
        then = recent[0]
        period = (seconds - then.seconds) / max(len(recent) - 1, 1)
        frames = round(_PATIENCE_S / period) if period > 0 else 15
        level = max(_DETECT * self._sigma, 8.0)
        before = shift_whole(then.gray, *then.offset)
        _, moving = cv2.threshold(cv2.absdiff(gray, before), level, 255, cv2.THRESH_BINARY)
        moving = cv2.medianBlur(moving, 3)
        if any(then.offset):
            _blank_rim(moving, *then.offset)
        return moving, min(frames, 200)

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


def _blank_rim(moving: NDArray[np.uint8], dx: int, dy: int) -> None:
    """Clear where the earlier of two frames, shifted by (dx, dy), shows nothing."""
    height, width = moving.shape
    if dx > 0:
        moving[:, : dx + _EDGE_PX] = 0
    elif dx < 0:
        moving[:, max(width + dx - _EDGE_PX, 0) :] = 0
    if dy > 0:
        moving[: dy + _EDGE_PX] = 0
    elif dy < 0:
        moving[max(height + dy - _EDGE_PX, 0) :] = 0
