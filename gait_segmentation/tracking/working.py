# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The working image: the source scaled down once, in Lab, shared by all cues."""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.ego_motion.pyramid import Pyramid
from gait_segmentation.images import Window
from gait_segmentation.lab import REACH, gray_lab, is_gray
from gait_segmentation.sizes import shrink
from gait_segmentation.tracking.contrast import Contrast
from gait_segmentation.tracking.exposure import Exposure

__all__ = ['WorkingImage', 'working_scale', 'working_shape']


@dataclass(frozen=True)
class WorkingImage:
    """
    One frame at working size.

    ``bgr`` is (h, w, 3) uint8, ``gray`` its brightness, with which ``pyramid`` begins;
    ``textured`` says that it has no colour and shows gradient energy in the place of a* and b*
    (:func:`~gait_segmentation.lab.gray_lab`).  The conversion to Lab takes longer than anything
    else that is done to whole images, so it is made only where it is asked for.
    """

    stamp_ns: int
    bgr: NDArray[np.uint8]
    gray: NDArray[np.uint8]
    pyramid: Pyramid
    textured: bool
    _lab: NDArray[np.uint8]
    _converted: list[Window] = field(default_factory=list)

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
        made = small if gain == 1.0 else cv2.convertScaleAbs(small, alpha=gain)
        if contrast is not None:
            made = contrast.spread(made)
        if made is not small:
            gray = np.asarray(cv2.cvtColor(made, cv2.COLOR_BGR2GRAY))
            pyramid = Pyramid(gray)
        lab = np.zeros(made.shape, np.uint8)
        return cls(stamp_ns, made, gray, pyramid, texture and is_gray(made), lab)

    def toned(self, curve: NDArray[np.uint8]) -> WorkingImage:
        """
        Return the image with other grey levels, converted to Lab where this one is.

        :param curve: (256,) uint8, the new level of each.
        """
        bgr, gray = np.asarray(cv2.LUT(self.bgr, curve)), np.asarray(cv2.LUT(self.gray, curve))
        lab = np.zeros(bgr.shape, np.uint8)
        made = WorkingImage(self.stamp_ns, bgr, gray, Pyramid(gray), self.textured, lab)
        for window in self._converted:
            made.lab_about(window)
        return made

    @property
    def lab(self) -> NDArray[np.uint8]:
        """Return the whole image in CIE L*a*b* as OpenCV stores it, (h, w, 3) uint8."""
        return self.lab_about((slice(0, self.gray.shape[0]), slice(0, self.gray.shape[1])))

    def lab_about(self, window: Window) -> NDArray[np.uint8]:
        """Return an image like :attr:`lab` that is filled in at least in a window."""
        rows, columns = window
        for known_rows, known_columns in self._converted:
            if (
                known_rows.start <= rows.start
                and known_rows.stop >= rows.stop
                and known_columns.start <= columns.start
                and known_columns.stop >= columns.stop
            ):
                return self._lab
        if rows.start < rows.stop and columns.start < columns.stop:
            self._lab[window] = self._lab_of(window)
            self._converted.append(window)
        return self._lab

    def lab_every(self, every: Window) -> NDArray[np.uint8]:
        """
        Return some of the pixels in Lab, (h, w, 3) uint8.

        :param every: rows and columns with a step, so that not all need be converted.
        """
        if self.textured:
            return np.ascontiguousarray(self.lab[every])
        return np.asarray(cv2.cvtColor(np.ascontiguousarray(self.bgr[every]), cv2.COLOR_BGR2Lab))

    def _lab_of(self, window: Window) -> NDArray[np.uint8]:
        if not self.textured:
            return np.asarray(cv2.cvtColor(self.bgr[window], cv2.COLOR_BGR2Lab))
        # The energy at the window's edge depends on what lies beyond.
        top, left = (max(side.start - REACH, 0) for side in window)
        rows, columns = window
        lab = gray_lab(self.gray[top : rows.stop + REACH, left : columns.stop + REACH])
        return lab[rows.start - top : rows.stop - top, columns.start - left : columns.stop - left]


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
