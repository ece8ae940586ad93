# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a heat map knows better than the masks where a person is."""

from __future__ import annotations

import math
from collections import deque

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import Box
from gait_segmentation.heat_maps import own_regions
from gait_segmentation.images import Window
from gait_segmentation.scene.scene import Frame
from gait_segmentation.starting.blobs import BodyShapes

_SAME = 0.6
"""Intersection over union from which mask and region show the same."""

_FRAMES = 8
"""Frames in a row in which they must not."""

_BETTER, _OFF = 0.05, 0.25
"""
By how much the region must be more like a body, in the mean, and how far its height may be off, as
a logarithm.
"""


class MapWitness:
    """
    What a heat map shows of one person, beside the masks: a second hypothesis of where they are.

    Both are compared by what neither has learnt from itself: the shape and the size of a body.
    ``box`` is that of the region in the last frame, in working pixels, if it is not the mask's.
    """

    def __init__(self, shapes: BodyShapes) -> None:
        self.box: Box | None = None
        self._shapes = shapes
        self._gains: deque[float] = deque(maxlen=_FRAMES)

    def see(self, frame: Frame, mask: NDArray[np.uint8], window: Window, height: float) -> None:
        """
        Take in the mask of a frame, if the frame has a map of its own that can be trusted.

        :param mask: (h, w) uint8 0/255.
        :param window: rows and columns about the person, in which they are compared.
        :param height: of the body in pixels.
        """
        if frame.heat is None or frame.heat_frames or frame.heat_trust < 1:
            return
        mask = mask[window]
        own = own_regions(frame.heat[window], mask)
        region = np.asarray(cv2.threshold(own, 127, 255, cv2.THRESH_BINARY)[1])
        box = Box.around(region)
        both = cv2.countNonZero(cv2.bitwise_and(mask, region))
        if box is None or both >= _SAME * cv2.countNonZero(cv2.bitwise_or(mask, region)):
            self.box = None
            self._gains.clear()
            return
        gain = self._shapes.likeness_of(region) - self._shapes.likeness_of(mask)
        self.box = box.shifted(window[1].start, window[0].start)
        fits = abs(math.log(box.height / height)) < _OFF
        self._gains.append(gain if fits else -1.0)

    @property
    def overrules(self) -> bool:
        """Return whether the region has been the better hypothesis for long enough."""
        return len(self._gains) == _FRAMES and float(np.mean(self._gains)) > _BETTER
