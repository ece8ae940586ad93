# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
What the place looked like before somebody was found there, at the size people are tracked at.

A few frames of the last seconds are kept together with what moved in them.  Only when somebody is
found they are laid onto the newest frame, in a window, and each pixel is what most of the frames
show where nothing moved: so remembering costs next to nothing while nobody is there.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.geometry import compose, invert, scaling
from gait_segmentation.images import Window, shrink, warp_window

__all__ = ['Memory', 'Recollection']

_PERIOD_S = 0.12
"""Time between two frames that are kept."""

_MOST_FRAMES = 16
_LARGEST = 640
"""Longest side of what is kept."""

_MARGIN = 0.012
"""How far about what moves nothing is believed, in heights of the small image."""

_ALIKE = 20
"""Most that colours of the same pixel of the background differ by, in grey levels a channel."""

_LEAST_SHARE = 0.5
"""Share of the frames in which a pixel must look alike."""

_ALIGN_ROUNDS, _ALIGN_CUT = 3, 20.0
_LEAST_ALIGNED = 200
_MOST_ALIGNED_PX = 2.5

_LEAST_GAIN = 0.01
"""Least change of the exposure that is undone."""

_SIGMA_START, _SIGMA_LOW, _SIGMA_HIGH = 5.0, 2.5, 14.0
_LEAST_SPREAD = 50
_SURE_COUNT = 2
_NEUTRAL, _GAIN, _LIMIT = 4.0, 0.75, 3.0
"""Half the squared distance in ``sigma`` that says nothing, evidence per step, and its limit."""


@dataclass
class _Kept:
    """
    A frame: its (h, w, 3) uint8 image, what moved, and where it lies now.

    ``hidden`` is (h', w') uint8 of the small image's size, non-zero where something moved, on a
    canvas that lies in the frame by ``to_image``; ``to_now`` takes positions from the frame to
    the newest one, None if the camera has not moved.  Both in pixels of the small image.
    """

    image: NDArray[np.uint8]
    hidden: NDArray[np.uint8]
    to_image: NDArray[np.float64]
    seconds: float
    to_now: NDArray[np.float64] | None = None


@dataclass(frozen=True)
class Recollection:
    """
    The background as it is remembered, in a window of the newest frame.

    ``mean`` is (h, w, 3) uint8 Lab and ``count`` (h, w) uint8, in how many frames it was seen,
    0 where it is unknown.  ``sigma`` is the spread about it in grey levels.
    """

    window: Window
    mean: NDArray[np.uint8]
    count: NDArray[np.uint8]
    sigma: float

    def evidence(self, lab: NDArray[np.uint8], shadow_floor: float) -> NDArray[np.float32]:
        """
        Return evidence for a person, (h, w) float32 within +-3, 0 where nothing is known.

        What a shadow could be says nothing.

        :param lab: (h, w, 3) uint8, the window of the newest frame.
        :param shadow_floor: darkest shadow, as a share of the lightness.
        """
        here, mean = lab.astype(np.float32), self.mean.astype(np.float32)
        off = here - mean
        scale = np.float32(1 / (2 * self.sigma**2))
        chroma = (off[..., 1] ** 2 + off[..., 2] ** 2) * scale
        logit = _GAIN * (chroma + off[..., 0] ** 2 * scale - _NEUTRAL)
        # A shadow takes colour away in proportion to the light, or leaves it.
        share = here[..., 0] / np.maximum(mean[..., 0], 1)
        less = here[..., 1:] - 128 - share[..., None] * (mean[..., 1:] - 128)
        chroma = np.minimum(chroma, (less**2).sum(axis=2) * scale)
        shadow = np.maximum(_GAIN * (chroma - _NEUTRAL), 0)
        dark = (share < 1) & (share > shadow_floor)
        logit = np.where(dark, np.minimum(logit, shadow), logit)
        known = self.count.astype(np.float32)
        known = np.where(known >= _SURE_COUNT, known / (known + 1), 0)
        return (np.clip(logit, -_LIMIT, _LIMIT) * known).astype(np.float32)


class Memory:
    """Keeps a few of the last frames."""

    def __init__(self) -> None:
        """Remember nothing yet."""
        self._kept: deque[_Kept] = deque(maxlen=_MOST_FRAMES)
        self._small = (1, 1)

    def forget(self) -> None:
        """Remember nothing."""
        self._kept.clear()

    def update(
        self,
        image: NDArray[np.uint8],
        seconds: float,
        step: NDArray[np.float64] | None,
        hidden: NDArray[np.uint8],
        to_image: NDArray[np.float64],
    ) -> None:
        """
        Take in a frame.

        :param image: (H, W, 3) uint8 BGR.
        :param step: 2 x 3 transform of positions from the last frame to this one in pixels of
            the small image, None for the identity.
        :param hidden: (h, w) uint8 of the small image's size, non-zero where something moves.
        :param to_image: 2 x 3 transform of positions from those pixels to the small image's.
        """
        self._small = (hidden.shape[0], hidden.shape[1])
        if step is not None:
            for each in self._kept:
                each.to_now = step if each.to_now is None else compose(step, each.to_now)
        if self._kept and seconds - self._kept[-1].seconds < _PERIOD_S:
            return
        height, width = image.shape[:2]
        scale = min(1.0, _LARGEST / max(height, width))
        shape = max(1, round(height * scale)), max(1, round(width * scale))
        part = shrink(image, shape)
        if part is image:
            # The caller may fill its buffer anew.
            part = image.copy()
        self._kept.append(_Kept(part, hidden.copy(), to_image, seconds))

    def recall(
        self, now: NDArray[np.uint8], window: Window, apart: NDArray[np.uint8]
    ) -> Recollection | None:
        """
        Return what the background looks like in a window of the newest frame.

        :param now: (h, w, 3) uint8 BGR, the newest frame at the size asked for; at more than
            640 pixels nothing is known.
        :param window: the rows and columns.
        :param apart: (h', w') uint8 of the small image's size, non-zero where somebody is now.
        :returns: None if nothing is known there.
        """
        shape = (now.shape[0], now.shape[1])
        rows, columns = window
        if len(self._kept) < _SURE_COUNT or shape[0] > self._kept[-1].image.shape[0]:
            return None
        if rows.start >= rows.stop or columns.start >= columns.stop:
            return None
        up = scaling(shape[1] / self._small[1], shape[0] / self._small[0])
        down = invert(up)
        kernel = np.ones((2 * max(1, round(_MARGIN * self._small[0])) + 1,) * 2, np.uint8)
        here = np.ascontiguousarray(now[window])
        people = _laid(cv2.dilate(apart, kernel), up, window)
        images, masks = [], []
        for each in self._kept:
            small = shrink(each.image, shape)
            mask = cv2.dilate(each.hidden, kernel)
            place = each.to_image if each.to_now is None else compose(each.to_now, each.to_image)
            hidden = _laid(mask, compose(up, place), window)
            if each.to_now is None:
                part = small[window]
            else:
                motion = compose(compose(up, each.to_now), down)
                part, outside = _warped(small, motion, window)
                off = _misplaced(here, part, hidden | people | outside)
                motion = compose(np.array([[1.0, 0, off[0]], [0, 1.0, off[1]]]), motion)
                part, outside = _warped(small, motion, window)
                hidden |= outside
            images.append(_exposed_alike(part, here, hidden | people))
            masks.append(hidden)
        mean, count = _common(np.stack(images), np.stack(masks))
        lab = cv2.cvtColor(mean, cv2.COLOR_BGR2Lab)
        off = cv2.absdiff(cv2.cvtColor(here, cv2.COLOR_BGR2Lab), lab)
        off = off[(count >= _SURE_COUNT) & (people == 0)]
        return Recollection(window, lab, count, _spread(off))


def _spread(off: NDArray[np.uint8]) -> float:
    """Return the spread of differences in grey levels, as the background measures it."""
    if len(off) < _LEAST_SPREAD:
        return _SIGMA_START
    sigma = 1.2 * 1.4826 * (float(np.median(off)) + 0.5) + 1.5
    return min(max(sigma, _SIGMA_LOW), _SIGMA_HIGH)


def _laid(
    mask: NDArray[np.uint8], motion: NDArray[np.float64], window: Window
) -> NDArray[np.uint8]:
    """Return a small mask in a window of the newest frame, (h, w) uint8 0/255."""
    laid = warp_window(mask, motion, window, cv2.BORDER_CONSTANT)
    return np.asarray(cv2.compare(laid, 0, cv2.CMP_GT))


def _warped(
    image: NDArray[np.uint8], motion: NDArray[np.float64], window: Window
) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Return a frame moved onto the newest one in a window, and 255 where it shows nothing."""
    part = warp_window(image, motion, window)
    full = np.full(image.shape[:2], 255, np.uint8)
    inside = warp_window(full, motion, window, cv2.BORDER_CONSTANT)
    return part, np.asarray(cv2.compare(inside, 255, cv2.CMP_LT))


def _exposed_alike(
    then: NDArray[np.uint8], now: NDArray[np.uint8], hidden: NDArray[np.uint8]
) -> NDArray[np.uint8]:
    """Return an earlier frame as bright as the newest one."""
    use = cv2.bitwise_not(hidden)
    if cv2.countNonZero(use) < _LEAST_ALIGNED:
        return then
    gain = sum(cv2.mean(now, use)[:3]) / max(sum(cv2.mean(then, use)[:3]), 1.0)
    return then if abs(gain - 1) < _LEAST_GAIN else cv2.convertScaleAbs(then, alpha=gain)


def _misplaced(
    now: NDArray[np.uint8], then: NDArray[np.uint8], hidden: NDArray[np.uint8]
) -> tuple[float, float]:
    """Return by how much an earlier frame must yet be moved, by steps of Gauss and Newton."""
    a = cv2.GaussianBlur(cv2.cvtColor(now, cv2.COLOR_BGR2GRAY), (0, 0), 1.0).astype(np.float32)
    b = cv2.GaussianBlur(cv2.cvtColor(then, cv2.COLOR_BGR2GRAY), (0, 0), 1.0).astype(np.float32)
    gx = cv2.Sobel(b, cv2.CV_32F, 1, 0, ksize=1) / 2
    gy = cv2.Sobel(b, cv2.CV_32F, 0, 1, ksize=1) / 2
    x, y = 0.0, 0.0
    size = (b.shape[1], b.shape[0])
    for _ in range(_ALIGN_ROUNDS):
        shift = np.array([[1.0, 0, x], [0, 1.0, y]])
        rest = a - cv2.warpAffine(b, shift, size, borderMode=cv2.BORDER_REPLICATE)
        use = (hidden == 0) & (np.abs(rest) < _ALIGN_CUT)
        if np.count_nonzero(use) < _LEAST_ALIGNED:
            return 0.0, 0.0
        u, v, r = -gx[use], -gy[use], rest[use]
        xx, xy, yy = float(u @ u), float(u @ v), float(v @ v)
        determinant = xx * yy - xy * xy
        if determinant < 1e-3 * (xx + yy) ** 2:
            break
        bx, by = float(u @ r), float(v @ r)
        x += (yy * bx - xy * by) / determinant
        y += (xx * by - xy * bx) / determinant
    if np.hypot(x, y) > _MOST_ALIGNED_PX:
        return 0.0, 0.0
    return x, y


@njit(cache=True, nogil=True)
def _common(
    images: NDArray[np.uint8], masks: NDArray[np.uint8]
) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Return for each pixel the mean of what looks alike in most frames, and in how many."""
    frames, height, width = masks.shape
    mean = np.zeros((height, width, 3), np.uint8)
    count = np.zeros((height, width), np.uint8)
    order = np.zeros(frames, np.int64)
    for row in range(height):
        for col in range(width):
            known = 0
            for k in range(frames):
                if masks[k, row, col]:
                    continue
                place = known
                value = images[k, row, col, 1]
                while place > 0 and images[order[place - 1], row, col, 1] > value:
                    order[place] = order[place - 1]
                    place -= 1
                order[place] = k
                known += 1
            if known == 0:
                continue
            middle = order[known // 2]
            alike = 0
            sums = np.zeros(3, np.int64)
            for n in range(known):
                k = order[n]
                same = True
                for channel in range(3):
                    off = np.int32(images[k, row, col, channel]) - np.int32(
                        images[middle, row, col, channel]
                    )
                    if abs(off) > _ALIKE:
                        same = False
                if same:
                    alike += 1
                    for channel in range(3):
                        sums[channel] += images[k, row, col, channel]
            if alike < _LEAST_SHARE * known:
                continue
            for channel in range(3):
                mean[row, col, channel] = (sums[channel] + alike // 2) // alike
            count[row, col] = alike
    return mean, count
