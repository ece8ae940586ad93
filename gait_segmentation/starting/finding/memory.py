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
from numpy.typing import NDArray

from gait_segmentation.geometry import compose, invert, scaling
from gait_segmentation.images import Window
from gait_segmentation.lab import lab_of
from gait_segmentation.sizes import shrink
from gait_segmentation.starting.finding.overlay import exposed_alike, laid, misplaced, warped
from gait_segmentation.starting.finding.recollection import (
    SURE_COUNT,
    Recollection,
    agreed,
    spread,
)

__all__ = ['Memory']

_PERIOD_S = 0.12
"""Time between two frames that are kept."""

_MOST_FRAMES = 16
_LARGEST = 640
"""Longest side of what is kept."""

_MARGIN = 0.012
"""How far about what moves nothing is believed, in heights of the small image."""


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
        self,
        now: NDArray[np.uint8],
        window: Window,
        apart: NDArray[np.uint8],
        *,
        textured: bool = False,
    ) -> Recollection | None:
        """
        Return what the background looks like in a window of the newest frame.

        :param now: (h, w, 3) uint8 BGR, the newest frame at the size asked for; at more than
            640 pixels nothing is known.
        :param window: the rows and columns.
        :param apart: (h', w') uint8 of the small image's size, non-zero where somebody is now.
        :param textured: whether gradient energy stands for colours (:mod:`gait_segmentation.lab`).
        :returns: None if nothing is known there.
        """
        shape = (now.shape[0], now.shape[1])
        rows, columns = window
        if len(self._kept) < SURE_COUNT or shape[0] > self._kept[-1].image.shape[0]:
            return None
        if rows.start >= rows.stop or columns.start >= columns.stop:
            return None
        up = scaling(shape[1] / self._small[1], shape[0] / self._small[0])
        down = invert(up)
        kernel = np.ones((2 * max(1, round(_MARGIN * self._small[0])) + 1,) * 2, np.uint8)
        here = np.ascontiguousarray(now[window])
        people = laid(cv2.dilate(apart, kernel), up, window)
        images, masks = [], []
        for each in self._kept:
            small = shrink(each.image, shape)
            mask = cv2.dilate(each.hidden, kernel)
            place = each.to_image if each.to_now is None else compose(each.to_now, each.to_image)
            hidden = laid(mask, compose(up, place), window)
            if each.to_now is None:
                part = small[window]
            else:
                motion = compose(compose(up, each.to_now), down)
                part, outside = warped(small, motion, window)
                off = misplaced(here, part, hidden | people | outside)
                motion = compose(np.array([[1.0, 0, off[0]], [0, 1.0, off[1]]]), motion)
                part, outside = warped(small, motion, window)
                hidden |= outside
            images.append(exposed_alike(part, here, hidden | people))
            masks.append(hidden)
        mean, count = agreed(np.stack(images), np.stack(masks))
        lab = lab_of(mean, textured=textured)
        off = cv2.absdiff(lab_of(here, textured=textured), lab)
        off = off[(count >= SURE_COUNT) & (people == 0)]
        return Recollection(window, lab, count, spread(off))
