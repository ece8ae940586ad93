# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The working image: the source scaled down once, in Lab, shared by all cues."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.ego_motion.pyramid import Pyramid
from gait_segmentation.images import Window
from gait_segmentation.lab import REACH, gray_lab, is_gray
from gait_segmentation.sizes import shrink
from gait_segmentation.tracking.picture.contrast import Contrast
from gait_segmentation.tracking.picture.exposure import Exposure

__all__ = ['WorkingImage', 'working_scale', 'working_shape']


_LEVELS = np.arange(256, dtype=np.uint8)


class _Parts:
    """A (h, w, 3) uint8 image of which parts are made when they are asked for."""

    def __init__(self, shape: tuple[int, ...]) -> None:
        self._pixels = np.empty(shape, np.uint8)
        self._made: list[Window] = []

    def about(
        self, window: Window, make: Callable[[Window, NDArray[np.uint8]], object]
    ) -> NDArray[np.uint8]:
        """
        Return the image, made at least in a window; elsewhere it may be anything.

        :param make: fills in a window of the image.
        """
        rows, columns = window
        for made_rows, made_columns in self._made:
            if (
                made_rows.start <= rows.start
                and made_rows.stop >= rows.stop
                and made_columns.start <= columns.start
                and made_columns.stop >= columns.stop
            ):
                return self._pixels
        if rows.start < rows.stop and columns.start < columns.stop:
            make(window, self._pixels[window])
            self._made.append(window)
        return self._pixels


@dataclass(frozen=True)
class WorkingImage:
    """
    One frame at working size.

    ``gray`` is its brightness, (h, w) uint8, with which ``pyramid`` begins; ``textured`` says that
    it has no colour and shows gradient energy in the place of a* and b*
    (:func:`~gait_segmentation.lab.gray_lab`).  The conversion to Lab takes longer than
    anything else that is done to whole images, so it is made only where it is asked for, and so
    are colours of other levels than the source has.
    """

    stamp_ns: int
    gray: NDArray[np.uint8]
    pyramid: Pyramid
    textured: bool
    _colours: NDArray[np.uint8]
    _curve: NDArray[np.uint8] | None
    _bgr: _Parts
    _lab: _Parts

    @classmethod
    def of(
        cls,
        image: NDArray[np.uint8],
        stamp_ns: int,
        shape: tuple[int, int],
        exposure: Exposure | None = None,
        contrast: Contrast | None = None,
        *,
        texture: bool = True,
    ) -> WorkingImage:
        """
        Scale a frame.

        :param image: (H, W, 3) uint8 BGR.
        :param shape: (h, w) of the working image.
        :param exposure: whose jumps are undone, if any.
        :param contrast: which spreads the levels, if any.
        :param texture: whether gradient energy stands for colours that there are not.
        """
        small = shrink(image, shape)
        if small is image:
            # Conversions may come later, when the caller has already filled its buffer anew.
            small = image.copy()
        gray = np.asarray(cv2.cvtColor(small, cv2.COLOR_BGR2GRAY))
        pyramid = Pyramid(gray)
        # First, as a jump is a factor only of the levels as they came.
        gain = 1.0 if exposure is None else exposure.update(pyramid)
        curve = None if gain == 1.0 else np.asarray(cv2.convertScaleAbs(_LEVELS, alpha=gain))
        if contrast is not None:
            curve = _both(curve, contrast.curve_for(small, curve))
        if curve is not None:
            # Not of the colours with other levels, which would take three times as long.
            gray = np.asarray(cv2.LUT(gray, curve))
            pyramid = Pyramid(gray)
        textured = texture and is_gray(small)
        parts = _Parts(small.shape), _Parts(small.shape)
        return cls(stamp_ns, gray, pyramid, textured, small, curve, *parts)

    @property
    def bgr(self) -> NDArray[np.uint8]:
        """Return the whole image, (h, w, 3) uint8."""
        return self.bgr_about(self._all)

    def bgr_about(self, window: Window) -> NDArray[np.uint8]:
        """Return an image like :attr:`bgr` that is made at least in a window."""
        return self._colours if self._curve is None else self._bgr.about(window, self._make_bgr)

    @property
    def lab(self) -> NDArray[np.uint8]:
        """Return the whole image in CIE L*a*b* as OpenCV stores it, (h, w, 3) uint8."""
        return self.lab_about(self._all)

    def lab_about(self, window: Window) -> NDArray[np.uint8]:
        """Return an image like :attr:`lab` that is made at least in a window."""
        return self._lab.about(window, self._make_lab)

    def lab_part(self, window: Window) -> NDArray[np.uint8]:
        """Return a window in Lab, (h, w, 3) uint8, its rows contiguous as kernels want them."""
        return np.ascontiguousarray(self.lab_about(window)[window])

    def lab_every(self, every: Window) -> NDArray[np.uint8]:
        """
        Return some of the pixels in Lab, (h, w, 3) uint8.

        :param every: rows and columns with a step, so that not all need be converted.
        """
        if self.textured:
            return np.ascontiguousarray(self.lab[every])
        part = np.ascontiguousarray(self._colours[every])
        if self._curve is not None:
            part = np.asarray(cv2.LUT(part, self._curve))
        return np.asarray(cv2.cvtColor(part, cv2.COLOR_BGR2Lab))

    @property
    def _all(self) -> Window:
        return slice(0, self.gray.shape[0]), slice(0, self.gray.shape[1])

    def _make_bgr(self, window: Window, out: NDArray[np.uint8]) -> None:
        assert self._curve is not None
        cv2.LUT(self._colours[window], self._curve, out)

    def _make_lab(self, window: Window, out: NDArray[np.uint8]) -> None:
        if not self.textured:
            cv2.cvtColor(self.bgr_about(window)[window], cv2.COLOR_BGR2Lab, out)
            return
        # The energy at the window's edge depends on what lies beyond.
        top, left = (max(side.start - REACH, 0) for side in window)
        rows, columns = window
        lab = gray_lab(self.gray[top : rows.stop + REACH, left : columns.stop + REACH])
        out[:] = lab[
            rows.start - top : rows.stop - top, columns.start - left : columns.stop - left
        ]


def _both(
    first: NDArray[np.uint8] | None, second: NDArray[np.uint8] | None
) -> NDArray[np.uint8] | None:
    """Return one curve of levels after another, None if there is neither."""
    if first is None or second is None:
        return second if first is None else first
    return second[first]


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
