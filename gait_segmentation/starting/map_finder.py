# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""People found in heat maps: regions that have the shape of a body."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import takewhile

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import Box
from gait_segmentation.heat_maps import HeatMap
from gait_segmentation.starting.blobs import BodyShapes, normalised
from gait_segmentation.starting.finder import belongs

_LEVELS = 32, 127
"""
Values of a map from which regions are made: at an eighth what a network is unsure of is part of a
body; at one half people who touch may be apart.
"""

_ALIKE, _ENOUGH = 0.1, 0.2
"""
Tanimoto similarity with the best template from which a region may be a body, and how much more it
must be in sum over maps in a row: the clear shape of a body is enough at once.
"""


class MapFinder:
    """Finds people in heat maps."""

    def __init__(self, shapes: BodyShapes) -> None:
        self._shapes = shapes
        self._stamp_ns = 0
        self._regions: list[tuple[Box, float]] = []
        """What may be a body, in source pixels, and how sure that is by now."""

    def update(
        self,
        heat: HeatMap,
        source: tuple[int, int],
        occupied: Sequence[Box],
        least_height: float,
    ) -> list[Box]:
        """
        Take in a map, once, and return the boxes of people newly found, the tallest first.

        :param source: (H, W) of the frames.
        :param occupied: boxes of people known already, in source pixels.
        :param least_height: of a person who is found, in source pixels.
        """
        if heat.stamp_ns == self._stamp_ns or not heat.trust:
            return []
        self._stamp_ns = heat.stamp_ns
        before, self._regions = self._regions, []
        for box, evidence in self._bodies(heat.values, source, occupied, least_height):
            past = (known for other, known in before if belongs(other, [box]))
            self._regions.append((box, evidence + max(past, default=0.0)))
        self._regions.sort(key=lambda region: -region[0].height)
        # A taller one who is not sure yet may be so with the next map, and there may be one slot.
        found = list(takewhile(lambda region: region[1] >= _ENOUGH, self._regions))
        del self._regions[: len(found)]
        return [box for box, _ in found]

    def _bodies(
        self,
        values: NDArray[np.uint8],
        source: tuple[int, int],
        occupied: Sequence[Box],
        least_height: float,
    ) -> list[tuple[Box, float]]:
        """Return the regions that may be a body, none of them a part of another one."""
        across, down = source[1] / values.shape[1], source[0] / values.shape[0]
        regions: list[tuple[float, Box]] = []
        for level in _LEVELS:
            # Not cv2.compare: that takes an image of one pixel for something else.
            above = cv2.inRange(values, level + 1, 255)
            _, labels, stats, _ = cv2.connectedComponentsWithStats(above)
            # The first are the pixels below the level.
            for number, (x, y, w, h, _) in enumerate(stats[1:].tolist(), 1):
                box = Box(x * across, y * down, w * across, h * down)
                if box.height < least_height or belongs(box, occupied):
                    continue
                region = cv2.inRange(labels[y : y + h, x : x + w], number, number)
                shape = normalised(region, box.width / box.height)
                likeness = 0.0 if shape is None else self._shapes.likeness(shape)
                regions.append((likeness, box))
        # Of a region and its parts the one that shows most of a body.
        regions.sort(key=lambda region: -region[0] * region[1].height ** 2)
        whole: list[tuple[float, Box]] = []
        for likeness, box in regions:
            if all(box.iou(other) == 0 for _, other in whole):
                whole.append((likeness, box))
        return [(box, likeness - _ALIKE) for likeness, box in whole if likeness > _ALIKE]
