# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
What the place looked like before anybody is tracked, at the size people are tracked at.

It is the tracker's model of the background, learnt from some frames a second: so knowing the
place costs little while nobody is there.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.ego_motion.world_motion import WorldMotion
from gait_segmentation.geometry import compose, invert, scaling
from gait_segmentation.images import Window
from gait_segmentation.starting.finding.scene import SceneFrame
from gait_segmentation.tracking.background.model import BackgroundModel
from gait_segmentation.tracking.picture.contrast import Contrast
from gait_segmentation.tracking.picture.exposure import Exposure
from gait_segmentation.tracking.picture.working import WorkingImage, working_shape

__all__ = ['Past']

_PERIOD_S, _LONGEST_S, _SHARE = 0.12, 0.36, 0.1
"""
Time between two frames that are learnt: least, most, and as a share of the time for which the
place is known, since the longer it is, the less one more tells.
"""

_LARGEST = 640
"""Longest side of what is learnt."""

_MARGIN = 0.012
"""How far about what moves nothing is learnt, in heights of the image."""


class Past:
    """
    Learns the background of a place in which nobody is tracked yet.

    ``learnt`` is when a frame was learnt last, 0 if none was.
    """

    def __init__(self, source: tuple[int, int]) -> None:
        """Know nothing yet of images of (H, W)."""
        scale = min(1.0, _LARGEST / max(source))
        self._shape = working_shape(*source, scale)
        self._exposure, self._contrast = Exposure(), Contrast()
        self._model = BackgroundModel(self._shape)
        self._motion = WorldMotion()
        self.learnt = self._begun = 0.0
        self._newest: tuple[NDArray[np.uint8], SceneFrame] | None = None

    def update(self, image: NDArray[np.uint8], frame: SceneFrame, seconds: float) -> None:
        """
        Take in a frame.

        :param image: (H, W, 3) uint8 BGR.
        :param frame: what moves in it.
        """
        self._newest = image, frame
        if frame.step is not None:
            self._motion = WorldMotion.over([self._motion, WorldMotion(frame.step)])
        wait = min(max(_PERIOD_S, _SHARE * (self.learnt - self._begun)), _LONGEST_S)
        if seconds - self.learnt >= wait:
            self._begun, self.learnt = self._begun or seconds, seconds
            lab, hidden = self._follow()
            self._model.measure_noise(lab, hidden, [self._every])
            # What has left is no mean with what can be seen since.
            gone = self._model.contradicted(lab, self._every, 1.0)
            self._model.forget(np.where(hidden > 0, 0, gone))
            self._model.learn(lab, hidden)

    def levels(self) -> tuple[Exposure, Contrast]:
        """Return how the newest frame must be shown to look as the background does."""
        self._follow()
        return self._exposure, self._contrast

    def background(self, shape: tuple[int, int]) -> BackgroundModel:
        """Return the background in the newest frame for a working image of (h, w)."""
        self._follow()
        return self._model if shape == self._shape else self._model.resized(shape)

    @property
    def _every(self) -> Window:
        return slice(0, self._shape[0]), slice(0, self._shape[1])

    def _follow(self) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """
        Carry the background along to the newest frame.

        :returns: that frame, (h, w, 3) uint8 Lab, and (h, w) uint8, non-zero where the background
            cannot be seen.
        """
        assert self._newest is not None
        image, frame = self._newest
        hidden = self._enlarged(frame)
        lab = WorkingImage.of(image, 1, self._shape, self._exposure, self._contrast).lab
        if self._motion.camera is not None:
            small = frame.hidden.shape
            up = scaling(self._shape[1] / small[1], self._shape[0] / small[0])
            motion = WorldMotion(compose(compose(up, self._motion.camera), invert(up)))
            self._model = self._model.moved([motion])
            self._motion = WorldMotion()
        return lab, hidden

    def _enlarged(self, frame: SceneFrame) -> NDArray[np.uint8]:
        """Return where the background cannot be seen, (h, w) uint8 of the size that is learnt."""
        hidden = frame.in_image(frame.hidden)
        side = 2 * max(1, round(_MARGIN * hidden.shape[0])) + 1
        hidden = cv2.dilate(hidden, np.ones((side, side), np.uint8))
        size = self._shape[::-1]
        return np.asarray(cv2.resize(hidden, size, interpolation=cv2.INTER_NEAREST))
