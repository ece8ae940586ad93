# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""People in a heat map: regions that have the shape of a body."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.detector.detection import PART, Detection
from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.geometry import Box
from gait_segmentation.heat_maps import HeatMap, label_regions
from gait_segmentation.images import tanimoto

_SHAPE_ROWS = 24  # height in pixels at which regions are compared with templates

_LEVELS = 32, 127
"""
Values from which regions are made: at an eighth what a network is unsure of is part of a body; at
one half people who touch may be apart.
"""

_LIKE_A_BODY = 0.1
"""Tanimoto similarity with the best template from which a region may be a body."""

_SCORE = 0.3
"""Score of what has no such similarity: with .3 of it the shape of a body is clear."""

_LEFT_HEIGHT, _LEFT_BESIDE = 0.75, 0.25
"""
Of what may be left of somebody who leaves the image: its height over theirs, and how far beside
them it may be, in their heights.
"""


class BodyShapes:
    """Templates of a bank, every other phase and view, tight about the body and small."""

    def __init__(self, bank: TemplateBank) -> None:
        rows = bank.templates.shape[2]
        top, bottom = round(rows * (1 - bank.fill) / 2), round(rows * (1 + bank.fill) / 2)
        chosen = bank.templates[::2, ::2].reshape(-1, *bank.templates.shape[2:])
        # A template is never wider than twice its height.
        shapes = [normalised(template[top:bottom]) for template in chosen]
        self._shapes = np.stack([shape for shape in shapes if shape is not None])

    def likeness(self, shape: NDArray[np.uint8] | None) -> float:
        """Return the similarity of a normalised shape with the template most like it, 0 to 1."""
        return 0.0 if shape is None else float(tanimoto(self._shapes, shape).max())


def normalised(region: NDArray[np.uint8], aspect: float | None = None) -> NDArray[np.uint8] | None:
    """
    Return a tight region at a size of 24 x 48, its centre of mass in the middle.

    :param region: (h, w) uint8, 255 inside.
    :param aspect: its width over its height, if its pixels are not square.
    :returns: (24, 48) uint8, None of what is wider than that.
    """
    height, width = region.shape
    columns = max(1, round(_SHAPE_ROWS * (width / height if aspect is None else aspect)))
    if columns > 2 * _SHAPE_ROWS:
        return None
    small = np.asarray(cv2.resize(region, (columns, _SHAPE_ROWS), interpolation=cv2.INTER_AREA))
    mass = small.sum(axis=0, dtype=np.float64)
    middle = int(np.rint((mass @ np.arange(columns)) / max(mass.sum(), 1.0)))
    out = np.zeros((_SHAPE_ROWS, 2 * _SHAPE_ROWS), np.uint8)
    left = _SHAPE_ROWS - middle
    first, last = max(left, 0), min(left + columns, 2 * _SHAPE_ROWS)
    out[:, first:last] = small[:, first - left : last - left]
    return out


class MapRegions:
    """Finds people in the heat maps of others."""

    def __init__(self, shapes: BodyShapes) -> None:
        self._shapes = shapes
        self._stamp_ns = 0

    def detect(
        self,
        heat: HeatMap,
        source: tuple[int, int],
        least: float,
        known: Sequence[Box],
        lost: Sequence[Box] = (),
    ) -> list[Detection]:
        """
        Return whom a map shows beside who is known; a map is looked at once.

        :param source: (H, W) of the frames.
        :param least: height of who is found, like all others in source pixels.
        :param known: bodies of who is tracked, and boxes of who is detected.
        :param lost: bodies of who is lost, where they are expected.
        """
        if heat.stamp_ns == self._stamp_ns or not heat.trust:
            return []
        self._stamp_ns = heat.stamp_ns
        values = heat.values
        across, down = source[1] / values.shape[1], source[0] / values.shape[0]
        regions: list[tuple[float, Box]] = []
        for level in _LEVELS:
            labels, stats = label_regions(values, level)
            for number, (x, y, w, h, _) in enumerate(stats[1:].tolist(), 1):
                box = Box(x * across, y * down, w * across, h * down)
                if box.height < least or any(box.common_share(each) > PART for each in known):
                    continue
                region = cv2.inRange(labels[y : y + h, x : x + w], number, number)
                shape = normalised(region, box.width / box.height)
                regions.append((self._shapes.likeness(shape), box))
        # Of a region and its parts the one that shows most of a body.
        regions.sort(key=lambda region: -region[0] * region[1].height ** 2)
        found: list[Detection] = []
        for likeness, box in regions:
            apart = all(box.iou(other.box) == 0 for other in found)
            if apart and likeness > _LIKE_A_BODY and not _is_part(box, [*known, *lost], source):
                found.append(Detection(box, min(likeness + _SCORE, 1.0), by_map=True))
        return found


def _is_part(box: Box, people: Sequence[Box], source: tuple[int, int]) -> bool:
    """Return whether a region is what is left of somebody who leaves an image of (H, W)."""
    for body in people:
        inside = body.x >= 0 and body.right <= source[1] and body.bottom <= source[0]
        about = body.padded(_LEFT_BESIDE * body.height, _LEFT_BESIDE * body.height)
        if not inside and box.height < _LEFT_HEIGHT * body.height and about.iou(box) > 0:
            return True
    return False
