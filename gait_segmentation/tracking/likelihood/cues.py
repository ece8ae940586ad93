# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Evidence beside colour: what moves with the body, where the last mask was."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.ego_motion.world_motion import WorldMotion
from gait_segmentation.images import Window
from gait_segmentation.warping import warp_window

__all__ = ['add_motion', 'add_propagation']

_RESIDUAL_CUT = 30
_RESIDUAL_SIGMA = 12.0
_RESIDUAL_LIMIT = 2.0
_PROPAGATION_SLOPE = 0.02
_PROPAGATION_LIMIT = 3.0


def add_motion(
    logit: NDArray[np.float32],
    gray: NDArray[np.uint8],
    earlier: NDArray[np.uint8],
    motion: WorldMotion,
    body: NDArray[np.float64],
    window: Window,
    weight: float,
) -> NDArray[np.float32]:
    """
    Add the evidence that pixels move with the body rather than stay with the world.

    An earlier frame is carried to this one twice, with the world and with the body; a pixel
    belongs to the one that explains it better.  Limited to +-2 times the weight.

    :param logit: (h, w) float32 of the window, changed.
    :param gray: (H, W) uint8 brightness of this frame.
    :param earlier: (H, W) uint8, that of a frame some frames back.
    :param motion: of the still world from then to now.
    :param body: 2 x 3 transform of positions on the body, likewise.
    :param window: the window's rows and columns.
    :returns: the evidence itself, (h, w) float32 within +-2.
    """
    stays = motion.warped(earlier, window)
    moves = warp_window(earlier, body, window)
    stay, move = (
        np.square(
            np.minimum(cv2.blur(cv2.absdiff(gray[window], each), (3, 3)), _RESIDUAL_CUT),
            dtype=np.float32,
        )
        for each in (stays, moves)
    )
    evidence = np.clip((stay - move) / (2 * _RESIDUAL_SIGMA**2), -_RESIDUAL_LIMIT, _RESIDUAL_LIMIT)
    logit += np.float32(weight) * evidence
    return evidence


def add_propagation(
    logit: NDArray[np.float32], near: NDArray[np.float32], height: float, weight: float
) -> None:
    """
    Add the weak prior from the last mask; limited to +-3 times the weight.

    :param logit: (h, w) float32 of a window, changed.
    :param near: (h, w) float32, how far its pixels are from the outline of the last mask carried
        to this frame, positive inside.
    :param height: height of the body in pixels.
    """
    limit = weight * _PROPAGATION_LIMIT
    logit += np.clip(near * np.float32(weight / (_PROPAGATION_SLOPE * height)), -limit, limit)
