# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A mask of each person: by the pose network of mediapipe on a square about them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.detector.detection import Detection, SoftMask, associate
from gait_segmentation.detector.engine import Engine
from gait_segmentation.geometry import Box

MODEL = Path(__file__).with_name('person_masks.onnx.gz')
"""The network; where it comes from and its licence are told by the text beside it."""

_SQUARE_PX = 256
"""Side of the square that the network sees, in pixels."""

_SQUARE, _LOWER = 1.35, 0.03
"""Side of the square about a person, and how far it lies below their middle, in their height."""

_LEAST_SCORE = 0.4
"""Score from which a person who is not known yet is drawn."""

_FITS = 0.5
"""Intersection over union of a box and that of the mask in it, from which the latter is better."""

_DRAWN_BEYOND = 0.15
"""How far beyond its box a person may be drawn, in the box's height."""

_AT_BORDER, _LONGEST, _MOST_HIDDEN = 0.02, 2.5, 0.55
"""
How near the border of the image a box ends that it may cut off, in the box's height; height of a
person over their width, and the share of them that it may cut off.
"""

_LEAST_DRAWN = 20
"""Pixels of a mask, as the network gives it, from which it has a box."""


class PersonMasks:
    """Draws people in single images, each on their own; may be called by several threads."""

    def __init__(self, path: Path = MODEL) -> None:
        """Load the network; DetectorError if it cannot be read."""
        self._network = Engine(path)

    def draw(
        self,
        image: NDArray[np.uint8],
        people: Sequence[Box],
        seen: Sequence[Detection] | None,
        most: int,
    ) -> tuple[tuple[Detection, ...] | None, tuple[Detection, ...]]:
        """
        Draw who is seen and who is known, those first who are new.

        :param image: (H, W, 3) uint8 BGR.
        :param people: boxes of who is known in it, who needs a mask most first.
        :param seen: whom a detector sees in it, None if it did not look.
        :param most: number of masks.
        :returns: whom it sees, some with masks, and detections (score 0) of the others drawn.
        """
        masked, drawn = list(seen or ()), []
        pairs = associate([[box] for box in people], masked)
        new = [
            number
            for number, each in enumerate(masked)
            if number not in pairs.values() and each.score >= _LEAST_SCORE
        ]
        new.sort(key=lambda number: -masked[number].score)
        for number in new[:most]:
            masked[number] = self._draw(image, masked[number])
        for index in range(min(max(most - len(new), 0), len(people))):
            if index in pairs:
                masked[pairs[index]] = self._draw(image, masked[pairs[index]])
            else:
                person = self._draw(image, Detection(people[index], 0.0))
                drawn.append(replace(person, box=_about(person) or person.box))
        return None if seen is None else tuple(masked), tuple(drawn)

    def _draw(self, image: NDArray[np.uint8], person: Detection) -> Detection:
        box = _whole(person.box, image.shape[0])
        scale = _SQUARE_PX / (_SQUARE * max(box.width, box.height))
        x, y = box.center_x, box.center_y + _LOWER * box.height
        offset = _SQUARE_PX / 2 - scale * x, _SQUARE_PX / 2 - scale * y
        there = np.array([[scale, 0, offset[0]], [0, scale, offset[1]]])
        square = cv2.warpAffine(image, there, (_SQUARE_PX, _SQUARE_PX), flags=cv2.INTER_LINEAR)
        odds = self._network(cv2.dnn.blobFromImage(square))[0]
        values = np.rint(255 / (1 + np.exp(-np.clip(odds, -20, 20)))).astype(np.uint8)
        beyond = _DRAWN_BEYOND * box.height
        limits = box.padded(beyond, beyond)
        return replace(person, mask=SoftMask(values, scale, offset, limits))


def _whole(box: Box, height: int) -> Box:
    """Return a box of all of a person whom the lower border of an image may cut off."""
    if box.bottom < height - 1 - _AT_BORDER * box.height:
        return box
    most = box.height / (1 - _MOST_HIDDEN)
    return Box(box.x, box.y, box.width, max(box.height, min(_LONGEST * box.width, most)))


def _about(person: Detection) -> Box | None:
    """Return the box about what is drawn of a person, None if it is hardly in their box."""
    assert person.mask is not None
    sure = person.mask.values > 127
    box = Box.around(sure) if np.count_nonzero(sure) > _LEAST_DRAWN else None
    if box is None:
        return None
    (x, y), scale = person.mask.offset, person.mask.scale
    box = box.shifted(-x, -y).scaled(1 / scale)
    return box if box.iou(person.box) >= _FITS else None


@cache
def default_masks() -> PersonMasks:
    """Return the masks that all of this process share; DetectorError if they cannot be loaded."""
    return PersonMasks()
