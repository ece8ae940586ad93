# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The tracker of the paper: adaptive mean shift (Wang and Yagi, TIP 2008), as read here.

The likelihood is made of the features that tell the person best from what is about the box.  Mean
shift on it moves the box, and its mass in the box scales it.  Then what is likely in the box is
learnt as the person, and what is about the box as surroundings.  No mask is fed back.

Mean shift with scale (Comaniciu, Ramesh and Meer 2003; Bradski 1998) moves, with the flat kernel,
a window to the centroid of the weights in it.  Nothing says that the person's centroid is the
centre of the window, so it is compared with that of a reference.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import BodyFrame, Box
from gait_segmentation.images import Window, distance_from, size_of
from gait_segmentation.paper.features import FeatureSelector, Pixels
from gait_segmentation.results import LOST
from gait_segmentation.scene.scene import Frame, View
from gait_segmentation.starting import FirstMask
from gait_segmentation.starting.first_mask import in_view
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.pixels import PixelClaim, Visibility
from gait_segmentation.tracking.pose import Pose
from gait_segmentation.tracking.track import Track

_ITERATIONS, _DONE_PX = 10, 0.25
"""Most steps of mean shift, and the step that is the last."""

_LEAST_MASS = 1e-3
"""Mass by which nothing can be compared."""

_SETTLED = 5
"""Frames over which the likelihood's mass in the box is averaged to compare later ones with."""


class WindowShift(NamedTuple):
    """Where the weights went, in pixels, and the ratio of sizes: the root of the masses'."""

    dx: float = 0.0
    dy: float = 0.0
    scale: float = 1.0


def mean_shift(
    weights: NDArray[np.uint8], reference: NDArray[np.uint8], window: Box
) -> WindowShift:
    """
    Move a window over the weights until its centroid lies as in the reference.

    :param weights: (h, w) uint8, e.g. the likelihood image.
    :param reference: (h, w) uint8, what the person looked like before.
    :param window: where the reference's person is, in pixels.
    :returns: the shift; zero if weights or reference are empty in the window.
    """
    mass, from_x, from_y = _moments(reference, window)
    found, dx, dy = 0.0, 0.0, 0.0
    for _ in range(_ITERATIONS if mass else 0):
        found, x, y = _moments(weights, window.shifted(dx, dy))
        if not found:
            break
        step_x, step_y = x - from_x - dx, y - from_y - dy
        dx, dy = dx + step_x, dy + step_y
        if max(abs(step_x), abs(step_y)) < _DONE_PX:
            break
    return WindowShift(dx, dy, math.sqrt(found / mass)) if found else WindowShift()


def _moments(weights: NDArray[np.uint8], window: Box) -> tuple[float, float, float]:
    """Return mass and centroid of the weights in a window clipped to the image."""
    left, top = max(round(window.x), 0), max(round(window.y), 0)
    right, bottom = round(window.x) + round(window.width), round(window.y) + round(window.height)
    part = weights[top : max(bottom, 0), left : max(right, 0)]
    moments = cv2.moments(part) if part.size else dict.fromkeys(('m00', 'm10', 'm01'), 0.0)
    mass = moments['m00']
    return mass, left + moments['m10'] / (mass or 1), top + moments['m01'] / (mass or 1)


def start_in(view: View, box: Box, *_: object, **__: object) -> FirstMask:
    """
    Return a start that takes the ellipse in a box for the person, whatever else is known.

    :param box: in working pixels of the view.
    """
    box = in_view(box, view.shape)
    mask = _ellipse(box, view.all)
    body = BodyFrame(box.center_x, box.center_y, max(box.height, 1.0))
    return FirstMask(mask, mask / np.float32(255), box, body)


class MeanShiftTrack(Track):
    """One person followed by adaptive mean shift: an ellipse in an upright box."""

    def __init__(
        self,
        track_id: int,
        view: View,
        start: FirstMask,
        config: TrackingConfig,
        **known: Any,
    ) -> None:
        """Begin with the box of a start in the newest frame of a view; see :func:`start_in`."""
        super().__init__(track_id, view, Pose.of(start.body, start.box), config, **known)
        self._selector = FeatureSelector()
        self._usual, self._frames = 1.0, 0
        self._learn()

    @property
    def box(self) -> Box:
        """Return the box, in source pixels."""
        return self.body

    def expected_mask(self) -> NDArray[np.uint8]:
        """Return the ellipse in the window about the person."""
        return _ellipse(self.pose.box, self.window)

    def claim(self) -> PixelClaim | None:
        """Judge pixels by the chosen features."""
        pose, window = self.pose, self.window
        if self.is_outside:
            return None
        logit = self._selector.log_ratio(_pixels(self.view.now, window))
        mask = self.expected_mask()
        away, hidden = distance_from(mask > 127), self.state == LOST
        return PixelClaim(window, logit, mask, away, pose.feet, pose.height, hidden)

    def looks_alike(self, mask: NDArray[np.uint8]) -> bool:
        """Return that the likelihood says all that this tracker knows."""
        return True

    def refine(self, values: NDArray[np.uint8], visibility: Visibility, claim: PixelClaim) -> None:
        """Move and scale the box by mean shift, and learn what is in it."""
        pose, window = self.pose, claim.window
        box = pose.box.shifted(-window[1].start, -window[0].start)
        shift = mean_shift(values, claim.mask, box)
        self.shift(shift.dx, shift.dy)
        states = self.history.states
        before = states[-2].displacement if len(states) > 1 else (0.0, 0.0)
        dx, dy = (now - then for now, then in zip(self.displacement, before, strict=True))
        x, y = self.pose.center_x - dx, self.pose.center_y - dy
        to_x, to_y = self.view.now.motion.carry(x, y)
        self.pose = self.pose.with_step((to_x - x, to_y - y), (dx, dy), self.view.step_s)
        if self._frames < _SETTLED:
            self._frames += 1
            self._usual += (shift.scale - self._usual) / self._frames
        else:
            # Without anything likely there is no size.
            self.pose = self.pose.grown(
                min(max(shift.scale / max(self._usual, _LEAST_MASS), 0.5), 2.0)
            )
        self._learn()

    def _learn(self) -> None:
        """Learn what is likely in the ellipse, at first all of it, and what is about the box."""
        box, window = self.pose.box, self.window
        if self.is_outside:
            return
        pixels = _pixels(self.view.now, window)
        labels = np.zeros(size_of(window), np.uint8)
        labels[box.shifted(-window[1].start, -window[0].start).slices(*labels.shape[::-1])] = 2
        person = _ellipse(box, window) > 0
        if self.features:
            person &= self._selector.log_ratio(pixels) >= 0
        labels[person] = 1
        self._selector.rank(pixels, labels)
        self.features = self._selector.features


def _pixels(frame: Frame, window: Window) -> Pixels:
    return Pixels(frame.image.bgr[window], frame.image.gray[window])


def _ellipse(box: Box, window: Window) -> NDArray[np.uint8]:
    """Return the ellipse in a box as it lies in a window, (h, w) uint8 0/255."""
    out = np.zeros(size_of(window), np.uint8)
    center = box.center_x - window[1].start - 0.5, box.center_y - window[0].start - 0.5
    cv2.ellipse(out, (center, (box.width, box.height), 0.0), 255, cv2.FILLED)
    return out
