# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The working image, shared by all cues: the source scaled down once, in Lab and at half sizes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.colour import gray_lab, is_gray
from gait_segmentation.images import Window, shrink
from gait_segmentation.scene.ego_motion import Pyramid
from gait_segmentation.scene.light import Contrast, Light


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
        :param light: which is undone, if any.
        :param contrast: which spreads the levels, if any.
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

    def shrunk(self, shape: tuple[int, int]) -> NDArray[np.uint8]:
        """Return the image in Lab at a smaller (h, w), (h, w, 3) uint8; see :attr:`lab`."""
        source = self.gray if self.textured else self.bgr
        return _lab_of(shrink(source, shape, cv2.INTER_AREA))

    @cached_property
    def lab(self) -> NDArray[np.uint8]:
        """Return the image in CIE L*a*b* as OpenCV stores it, (h, w, 3) uint8."""
        return _lab_of(self.gray if self.textured else self.bgr)

    def lab_part(self, window: Window) -> NDArray[np.uint8]:
        """Return a window in Lab, (h, w, 3) uint8, its rows contiguous as kernels want them."""
        return np.ascontiguousarray(self.lab[window])


def _lab_of(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return an image in Lab, with gradient energy in the place of colours if it is (h, w)."""
    return (
        gray_lab(image) if image.ndim == 2 else np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2Lab))
    )


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
