# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A mask of each person: by the pose network of mediapipe on a square about them."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.detector.detection import SoftMask
from gait_segmentation.detector.engine import Engine
from gait_segmentation.geometry import Box

MODEL = Path(__file__).with_name('person_masks.onnx.gz')
"""The network; where it comes from and its licence are told by the text beside it."""

_SQUARE_PX = 224
"""Side of the square that the network sees, in pixels."""

_SQUARE, _LOWER = 1.35, 0.03
"""Side of the square about a person, and how far it lies below their middle, in their height."""

_DRAWN_BEYOND = 0.15
"""How far beyond its box a person may be drawn, in the box's height."""

_AT_BORDER, _LONGEST, _MOST_HIDDEN = 0.02, 2.5, 0.55
"""
How near the border of the image a box ends that it may cut off, in the box's height; height of a
person over their width, and the share of them that it may cut off.
"""


class PersonMasks:
    """Draws people in single images, each on their own; may be called by several threads."""

    def __init__(self, path: Path = MODEL) -> None:
        """Load the network; DetectorError if it cannot be read."""
        self._network = Engine(path)

    def draw(self, image: NDArray[np.uint8], person: Box) -> SoftMask:
        """Draw the person in a box of an image, (H, W, 3) uint8 BGR."""
        box = _whole(person, image.shape[0])
        scale = _SQUARE_PX / (_SQUARE * max(box.width, box.height))
        x, y = box.center_x, box.center_y + _LOWER * box.height
        offset = _SQUARE_PX / 2 - scale * x, _SQUARE_PX / 2 - scale * y
        there = np.array([[scale, 0, offset[0]], [0, scale, offset[1]]])
        square = cv2.warpAffine(image, there, (_SQUARE_PX, _SQUARE_PX), flags=cv2.INTER_LINEAR)
        result = self._network(cv2.dnn.blobFromImage(square))
        odds, presence = result[:-1].reshape(square.shape[:2]), result[-1]
        values = np.rint(255 / (1 + np.exp(-np.clip(odds, -20, 20)))).astype(np.uint8)
        beyond = _DRAWN_BEYOND * box.height
        limits = box.padded(beyond, beyond)
        return SoftMask(values, scale, offset, limits, float(presence))


def _whole(box: Box, height: int) -> Box:
    """Return a box of all of a person whom the lower border of an image may cut off."""
    if box.bottom < height - 1 - _AT_BORDER * box.height:
        return box
    most = box.height / (1 - _MOST_HIDDEN)
    return Box(box.x, box.y, box.width, max(box.height, min(_LONGEST * box.width, most)))


@cache
def default_masks() -> PersonMasks:
    """Return the masks that all of this process share; DetectorError if they cannot be loaded."""
    return PersonMasks()
