# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A small network that says where people are."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.detector.detection import SAME_PERSON, Detection, merged
from gait_segmentation.detector.engine import Engine
from gait_segmentation.geometry import Box
from gait_segmentation.images import check_image, size_of

MODEL = Path(__file__).with_name('person_detector.onnx.gz')
"""The network; where it comes from and its licence are told by the text beside it."""

_LONGER_SIDE, _CLOSER_SIDE = 320, 512
"""Longer side of the image that the network sees at any look, and at a closer one, in pixels."""

_SEEN_PX = 32
"""Height in that image from which a person who is there is seen, mostly."""

LEAST_SHARE = _SEEN_PX / _LONGER_SIDE
"""The same over the longer side of any image."""

CLOSER_SHARE = 2 * LEAST_SHARE
"""Likewise that up to which a closer look sees more people, such as in a crowd."""

_ABOUT, _ABOUT_SIDE = 3, 192
"""Side of the square about somebody, in their height, and in pixels of what the network sees."""

_MULTIPLE = 32
"""
Both sides are filled up to a multiple of this, and at least two of it: where the coarsest features
have one row, OpenCV 5.0 reads what it has not written.
"""

_GREY = (127.5, 127.5, 127.5)
_CELL_PX = 4
"""Pixels of that image which a cell of the network's output stands for."""

LEAST_SCORE, _NMS_OVERLAP = 0.15, 0.6
"""Score from which somebody is told of, and overlap of two boxes of one person."""


class PersonDetector:
    """Detects people in single images; may be called by several threads."""

    def __init__(self, path: Path = MODEL) -> None:
        """Load the network; DetectorError if it cannot be read."""
        self._network = Engine(path)

    def people(self, image: NDArray[np.uint8]) -> list[Detection]:
        """
        Detect people.

        :param image: (H, W, 3) uint8 BGR.
        :returns: who is seen, the surest first.
        :raises InputError: if it is no image.
        """
        return self._detect(image, _LONGER_SIDE)

    def closely(self, image: NDArray[np.uint8]) -> list[Detection]:
        """Detect people, and smaller ones, at three and a half times the cost."""
        # Of others the first look tells as much.
        most = CLOSER_SHARE * max(image.shape[:2])
        closer = [each for each in self._detect(image, _CLOSER_SIDE) if each.box.height < most]
        return merged(self.people(image), closer)

    def about(self, image: NDArray[np.uint8], box: Box) -> list[Detection]:
        """Detect whoever may be in a box, at half the cost of a look at all of the image."""
        size = _ABOUT * box.height
        around = Box.from_center(box.center_x, box.center_y, size, size)
        part = around.slices(image.shape[1], image.shape[0])
        x, y = part[1].start, part[0].start
        side = round(_ABOUT_SIDE * max(size_of(part)) / size)
        seen = self._detect(np.ascontiguousarray(image[part]), side)
        # Others in it may be cut off.
        here = [Detection(each.box.shifted(x, y), each.score) for each in seen]
        return [each for each in here if each.box.iou(box) >= SAME_PERSON][:1]

    def _detect(self, image: NDArray[np.uint8], side: int) -> list[Detection]:
        """Detect people in an image whose longer side is made so many pixels."""
        check_image(image)
        height, width = image.shape[:2]
        small = resized(image, side / max(height, width))
        rows, columns = small.shape[:2]
        below, right = (max(-side % _MULTIPLE, 2 * _MULTIPLE - side) for side in (rows, columns))
        small = cv2.copyMakeBorder(small, 0, below, 0, right, cv2.BORDER_CONSTANT)
        logits, *sizes = self._network(cv2.dnn.blobFromImage(small, mean=_GREY))
        # One person has one peak.
        peaks = logits == cv2.dilate(logits, np.ones((3, 3), np.uint8))
        y, x = np.nonzero(peaks & (logits > math.log(LEAST_SCORE / (1 - LEAST_SCORE))))
        tall, wide, dy, dx = (each[y, x] for each in sizes)
        boxes = np.stack([x + dx - wide / 2, y + dy - tall / 2, wide, tall], 1)
        boxes *= _CELL_PX * np.tile([width / columns, height / rows], 2)
        scores = 1 / (1 + np.exp(-logits[y, x]))
        return detections_of(boxes, scores, image.shape)


def resized(image: NDArray[np.uint8], scale: float) -> NDArray[np.uint8]:
    """Return a (H, W, 3) uint8 image at a scale, of at least a pixel, as networks see it."""
    height, width = image.shape[:2]
    size = max(1, round(width * scale)), max(1, round(height * scale))
    how = cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR
    return np.asarray(cv2.resize(image, size, interpolation=how))


def detections_of(
    boxes: NDArray[np.floating], scores: NDArray[np.floating], shape: tuple[int, ...]
) -> list[Detection]:
    """
    Return people, each of them once and inside the image, the surest first.

    :param boxes: (n, 4) left, top, width and height in pixels of the image.
    :param scores: (n,), 0..1.
    :param shape: (H, W, ...) of the image.
    """
    kept = cv2.dnn.NMSBoxes(boxes.tolist(), scores.tolist(), LEAST_SCORE, _NMS_OVERLAP)
    found = []
    for index in np.reshape(np.array(kept, int), -1):
        left, top, across, down = boxes[index].tolist()
        if across > 0 and down > 0:
            box = Box(left, top, across, down).clipped(shape[1], shape[0])
            if box is not None:
                found.append(Detection(box, float(scores[index])))
    return found


@cache
def default_detector() -> PersonDetector:
    """Return the detector that all of this process share; DetectorError if it cannot be loaded."""
    return PersonDetector()
