# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Weaker evidence beside colour: what moves with the body, and where the last mask was."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import Window, signed_distance, warp_window

__all__ = ['motion_logit', 'propagation_logit']

_RESIDUAL_CUT = 30
_RESIDUAL_SIGMA = 12.0
_RESIDUAL_LIMIT = 2.0
_PROPAGATION_SLOPE = 0.02
_PROPAGATION_LIMIT = 3.0


def _residual(now: NDArray[np.uint8], then: NDArray[np.uint8]) -> NDArray[np.float32]:
    difference = cv2.blur(cv2.absdiff(now, then), (3, 3))
    return np.minimum(difference, _RESIDUAL_CUT).astype(np.float32)


def motion_logit(
    gray: NDArray[np.uint8],
    earlier: NDArray[np.uint8],
    camera: NDArray[np.float64],
    body: NDArray[np.float64],
    window: Window,
) -> NDArray[np.float32]:
    """
    Return the evidence that pixels move with the body rather than stay with the world.

    An earlier frame is carried to this one twice, with the camera and with the body; a pixel
    belongs to the one that explains it better.

    :param gray: (H, W) uint8 lightness of this frame.
    :param earlier: (H, W) uint8, that of a frame some frames back.
    :param camera: 2 x 3 transform of positions of the still world from then to now.
    :param body: the same of the body.
    :param window: rows and columns to compute.
    :returns: (h, w) float32, positive for person, limited to +-2.
    """
    now = gray[window]
    stays = _residual(now, warp_window(earlier, camera, window))
    moves = _residual(now, warp_window(earlier, body, window))
    logit = (stays * stays - moves * moves) / np.float32(2 * _RESIDUAL_SIGMA**2)
    return np.clip(logit, -_RESIDUAL_LIMIT, _RESIDUAL_LIMIT)


def propagation_logit(
    mask: NDArray[np.uint8], motion: NDArray[np.float64], window: Window, height: float
) -> NDArray[np.float32]:
    """
    Return the weak prior from the last mask, carried along with the body.

    :param mask: (H, W) uint8, the last mask at working size.
    :param motion: 2 x 3 transform of positions of the body from then to now.
    :param window: rows and columns to compute.
    :param height: height of the body in pixels.
    :returns: (h, w) float32, limited to +-3.
    """
    carried = warp_window(mask, motion, window, cv2.BORDER_CONSTANT) > 127
    logit = signed_distance(carried) / np.float32(_PROPAGATION_SLOPE * height)
    return np.clip(logit, -_PROPAGATION_LIMIT, _PROPAGATION_LIMIT)
