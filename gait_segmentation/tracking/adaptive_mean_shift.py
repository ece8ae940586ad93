# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The tracker of the paper: adaptive mean shift (Wang and Yagi, TIP 2008), as read here.

The likelihood is made of the features that tell the person best from what is about the box.  Mean
shift on it moves the box, and its mass in the box scales it.  Then what is likely in the box is
learnt as the person, and what is about the box as surroundings.  No mask is fed back.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import BodyFrame, Box
from gait_segmentation.images import Window, distance_from, size_of
from gait_segmentation.paper.features import FeatureSelector, View
from gait_segmentation.results import TRACKED
from gait_segmentation.starting import FirstMask
from gait_segmentation.starting.first_mask import in_view
from gait_segmentation.tracking.competition import Claim
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.records import Record, Shift
from gait_segmentation.tracking.target import Target
from gait_segmentation.tracking.visibility import Sight, mean_shift
from gait_segmentation.tracking.world import World

_LEAST_MASS = 1e-3
"""Mass by which nothing can be compared."""

_SETTLED = 5
"""Frames over which the likelihood's mass in the box is averaged to compare later ones with."""


def start_in(box: Box, shape: tuple[int, int]) -> FirstMask:
    """
    Return a start that takes the ellipse in a box for the person.

    :param box: in working pixels.
    :param shape: (h, w) of the working image.
    """
    box = in_view(box, shape)
    mask = _ellipse(box, (slice(0, shape[0]), slice(0, shape[1])))
    body = BodyFrame(box.center_x, box.center_y, max(box.height, 1.0))
    return FirstMask(mask, mask / np.float32(255), box, body)


class MeanShiftTarget(Target):
    """One person followed by adaptive mean shift: an ellipse in an upright box."""

    learns_from_masks = False

    def __init__(
        self, track_id: int, world: World, start: FirstMask, config: TrackingConfig
    ) -> None:
        """Begin with the box of a start in the world's newest frame; see :func:`start_in`."""
        super().__init__(track_id, world, start, config)
        self._selector = FeatureSelector()
        self._usual, self._frames = 1.0, 0
        self._learn(world.now)

    @property
    def box(self) -> Box:
        """Return the box, in source pixels."""
        return self.body

    def carried_mask(self) -> NDArray[np.uint8]:
        """Return the ellipse in the window about the person."""
        return _ellipse(self.person.box, self.window)

    def judge(self) -> Claim | None:
        """Return the likelihood of the chosen features, None if all of it is outside."""
        person, window = self.person, self.window
        if not all(size_of(window)):
            return None
        logit = self._selector.log_ratio(_view(self.world.now, window))
        mask = self.carried_mask()
        away = distance_from(mask > 127)
        lost = self.state != TRACKED
        return Claim(window, logit, mask, away, self.feet, person.height, lost)

    def _measured(self, seconds: float, body: NDArray[np.uint8]) -> Shift | None:
        """Return that only mean shift tells how far the body went."""
        return None

    def _refine(self, values: NDArray[np.uint8], sight: Sight, claim: Claim) -> None:
        """Move and scale the box by mean shift, and learn what is in it."""
        person, window = self.person, claim.window
        box = person.box.shifted(-window[1].start, -window[0].start)
        shift = mean_shift(values, claim.mask, box)
        self.shift_now(shift.dx, shift.dy)
        dx, dy = self.world.now.bodies[self.track_id]
        x, y = person.center_x - dx, person.center_y - dy
        to_x, to_y = self.world.now.motion.carry(x, y)
        person.learn_pace((to_x - x, to_y - y), (dx, dy), self.world.step_s)
        if self._frames < _SETTLED:
            self._frames += 1
            self._usual += (shift.scale - self._usual) / self._frames
        else:
            # Without anything likely there is no size.
            person.grow(min(max(shift.scale / max(self._usual, _LEAST_MASS), 0.5), 2.0))
        self._learn(self.world.now)

    def _learn(self, record: Record) -> None:
        """Learn what is likely in the ellipse, at first all of it, and what is about the box."""
        box, window = self.person.box, self.window
        if not all(size_of(window)):
            return
        view = _view(record, window)
        labels = np.zeros(size_of(window), np.uint8)
        labels[box.shifted(-window[1].start, -window[0].start).slices(*labels.shape[::-1])] = 2
        person = _ellipse(box, window) > 0
        if self.features:
            person &= self._selector.log_ratio(view) >= 0
        labels[person] = 1
        self._selector.learn(view, labels)
        self.features = self._selector.features


def _view(record: Record, window: Window) -> View:
    return View(record.image.bgr[window], record.image.gray[window])


def _ellipse(box: Box, window: Window) -> NDArray[np.uint8]:
    """Return the ellipse in a box as it lies in a window, (h, w) uint8 0/255."""
    out = np.zeros(size_of(window), np.uint8)
    center = box.center_x - window[1].start - 0.5, box.center_y - window[0].start - 0.5
    cv2.ellipse(out, (center, (box.width, box.height), 0.0), 255, cv2.FILLED)
    return out
