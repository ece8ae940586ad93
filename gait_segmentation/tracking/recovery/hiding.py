# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What stands before a person, as far as template and background tell."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import Window

__all__ = ['Hiding']

_MUCH = 0.25
"""Share of the template that looks like the known background of somebody hidden in part."""

_EDGE = 7
"""Pixels about what hides a person in which its edge would be followed in place of the body."""

_SMALL = np.ones((3, 3), np.uint8)


@dataclass(frozen=True)
class Hiding:
    """
    What is known to stand where the template is.

    ``pixels`` is (h, w) uint8 0/1 of a window, without what is very narrow, and ``share`` the
    share of the template that is not the person, without its rim.
    """

    window: Window
    pixels: NDArray[np.uint8]
    share: float

    @classmethod
    def of(
        cls,
        window: Window,
        mask: NDArray[np.uint8],
        template: NDArray[np.uint8],
        still: NDArray[np.bool_],
    ) -> Hiding:
        """
        Look at the template of a mask in a window.

        :param mask, template: (H, W) uint8, the mask 0/255.
        :param still: (h, w) of the window, whether pixels look like the known background.
        """
        body = cv2.inRange(template[window], 128, 255)
        pixels = ((body > 0) & still & (mask[window] == 0)).astype(np.uint8)
        # The rim does not count, where templates are wrong most often.
        inner = cv2.erode(body, _SMALL)
        covered = cv2.countNonZero(cv2.bitwise_and(pixels, inner))
        share = covered / max(cv2.countNonZero(inner), 1)
        return cls(window, cv2.morphologyEx(pixels, cv2.MORPH_OPEN, _SMALL), share)

    @property
    def much(self) -> bool:
        """Return whether it is more than a template may be wrong by."""
        return self.share > _MUCH

    def away(self, mask: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return a mask, (H, W) uint8, without what is near to what hides the person."""
        if not self.pixels.any():
            return mask
        side = 2 * _EDGE + 1
        away = mask.copy()
        away[self.window][cv2.dilate(self.pixels, np.ones((side, side), np.uint8)) > 0] = 0
        return away
