# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What somebody carries and no template has: likely for some time at one place on the body."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import BodyFrame, pixel_affine, template_to_image

__all__ = ['Carried']

_SIDE, _FILL = 96, 0.75
"""Rows and columns of the map of the body, and the share of them that its height takes."""

_RATE = 0.05
"""Share of a frame in the running mean: what is likely from now on counts after fourteen frames,
in which a wide thing that stays behind has moved on."""


class Carried:
    """
    Running mean of the likelihood in the frame of the body.

    What passes by, and what was taken for the person at first and stays behind, is soon at
    another place on the body; a bag in the hand is not.
    """

    def __init__(self) -> None:
        """Begin with somebody who carries nothing."""
        self._mean = np.zeros((_SIDE, _SIDE), np.float32)

    def at(self, body: BodyFrame, shape: tuple[int, ...]) -> NDArray[np.bool_]:
        """Return what was mostly likely until now, (h, w) bool, for a body in an image."""
        matrix = _matrix(body)
        return np.asarray(cv2.warpAffine(self._mean, matrix, (shape[1], shape[0])) > 0.5)

    def learn(self, likelihood: NDArray[np.uint8], body: BodyFrame) -> None:
        """
        Take in a frame.

        :param likelihood: (h, w) uint8, 255 = surely person.
        :param body: the body in its pixels.
        """
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        now = cv2.warpAffine(likelihood, _matrix(body), (_SIDE, _SIDE), flags=flags)
        cv2.accumulateWeighted(now / np.float32(255), self._mean, _RATE)


def _matrix(body: BodyFrame) -> NDArray[np.float64]:
    return pixel_affine(template_to_image(body, _SIDE, _SIDE, _FILL))
