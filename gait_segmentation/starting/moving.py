# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
What moves in the scene where nobody is tracked yet.

It is looked for in a small image, by the difference from a moment ago and from the background,
which is learnt where nothing moves.  No empty scene is needed: a walker stands out as soon as he
has moved on by his own width.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import Box
from gait_segmentation.images import Window, median
from gait_segmentation.scene.scene import Scene, WholeView
from gait_segmentation.scene.world_motion import WorldMotion
from gait_segmentation.starting.blobs import Blob, find_blobs

_PERIOD_S, _SHARE = 0.12, 0.1
"""
Time between two frames that are learnt, at most, and as a share of the time for which the place
is known, since the longer it is, the less one more tells.
"""

_MARGIN = 0.012
"""How far about what moves nothing is learnt, in heights of the image."""

_GAP_S = 0.14
"""Time between the two frames whose difference shows what moves now."""

_SPREADS = 2.0
"""Least difference that is motion, in spreads of a still pixel about its mean."""

_STEEP, _LEAST_STEEP = 4.0, 50
"""
Range of lightness about a pixel from which it tells by how much the place is off, in times of the
least difference; and the number of such pixels that are needed.
"""

_EDGE = np.ones((5, 5), np.uint8)
"""Rim of a warped frame that is not compared."""

_NEAR = np.ones((3, 7), np.uint8)
_WEATHER, _GAIN_WEATHER = 0.04, 0.2
"""
How near something must have been in the frame before that is not fleeting, the share of the image
that is fleeting in rain or snow, in the mean of some frames, and what a frame counts in it.
"""

_RIM = 5
"""Width of the rim of a box that keeps what moves in it apart."""

_UNKNOWN = 140
"""Likelihood where something moves before a background that has never been seen."""

_SHADOW_FLOOR = 0.6
"""Darkest shadow, as a share of the lightness of the background; what is darker are clothes."""

_GAIN = 64.0
"""Likelihood, of 255, for each of the log-odds."""

_BROKEN = 0.5
"""Share of pixels that differ at which the place is not the one learnt."""


@dataclass(frozen=True)
class MovingRegions:
    """
    What moves in one frame, in the searched image.

    ``likelihood`` is (h, w) uint8, 255 = surely no background.  ``blobs`` are what hangs
    together, and ``silhouettes`` (h, w) uint8 0/255 the blobs filled row by row between what
    moves now.
    ``shift`` is by how many pixels the world moved since the last frame, in the middle of the
    image.  ``fresh`` says that what was known before no longer holds.
    """

    likelihood: NDArray[np.uint8]
    blobs: list[Blob]
    silhouettes: NDArray[np.uint8]
    shift: tuple[float, float]
    fresh: bool


@dataclass
class _Recent:
    """The lightness of a frame, (h, w) uint8, and how the world has moved since."""

    seconds: float
    gray: NDArray[np.uint8]
    motion: WorldMotion


class MotionDetector:
    """Shows what moves in a scene before a camera that may move, and lets it learn the rest."""

    def __init__(self, scene: Scene, scale: float) -> None:
        """
        Begin with the newest frame of a scene.

        :param scale: from source pixels to those of the image that is searched.
        """
        self._scene, self._view = scene, WholeView(scene.source, scale)
        scene.add(self._view)
        self._forget()

    def _forget(self) -> None:
        self._view.reset()
        self._recent: deque[_Recent] = deque()
        self._evidence = np.zeros(self._view.shape, np.uint8)
        self._weather = 0.0
        self._begun = self._learnt = 0.0

    def close(self) -> None:
        """Let the scene go on without a view for the search."""
        self._scene.moving = None
        self._scene.views = [each for each in self._scene.views if each is not self._view]

    @property
    def known(self) -> WholeView | None:
        """Return the view of all of the scene, None if nothing is known of it."""
        return self._view if self._view.is_known else None

    def update(self, taken: Sequence[Box] = (), apart: Sequence[Box] = ()) -> MovingRegions:
        """
        Look at the newest frame of the scene.

        :param taken: boxes in the searched image in which nobody is looked for, because it is
            known who is there.
        :param apart: boxes in which what moves does not hang together with what moves outside.
        """
        image = self._view.now.image
        seconds, step = image.stamp_ns / 1e9, self._view.step
        self._view.step = WorldMotion()
        height, width = self._view.shape
        lab = np.asarray(cv2.blur(image.lab, (3, 3)))
        moving = self._moving(np.ascontiguousarray(lab[:, :, 0]), seconds, step)
        likelihood = self._compare(lab, moving)
        windows = [box.slices(width, height) for box in taken]
        for window in windows:
            likelihood[window] = moving[window] = 0
        _, evidence = cv2.threshold(likelihood, 127, 255, cv2.THRESH_BINARY)
        evidence = cv2.bitwise_or(evidence, moving)
        fresh = cv2.countNonZero(evidence) > _BROKEN * evidence.size
        if fresh:
            self._forget()
            evidence[:] = likelihood[:] = 0
        lasting = self._lasting(evidence, step)
        if lasting is not None:
            evidence, moving, likelihood = (
                cv2.bitwise_and(each, lasting) for each in (evidence, moving, likelihood)
            )
        for box in apart:
            corners = (round(box.x), round(box.y)), (round(box.right), round(box.bottom))
            for each in (evidence, moving):
                cv2.rectangle(each, *corners, 0, _RIM)
        blobs, silhouettes = find_blobs(evidence, moving)
        filled = silhouettes.copy()
        for window in windows:
            filled[window] = 255
        self._scene.moving = filled
        self._learn(filled, seconds)
        x, y = step.carry(width / 2, height / 2)
        return MovingRegions(
            likelihood, blobs, silhouettes, (x - width / 2, y - height / 2), fresh
        )

    def _lasting(self, evidence: NDArray[np.uint8], step: WorldMotion) -> NDArray[np.uint8] | None:
        """Return what was there in the last frame, too, (h, w) uint8, None in fair weather."""
        before, self._evidence = self._evidence, evidence
        lasting = cv2.dilate(step.warped(before, _all_of(before)), _NEAR)
        fleeting = cv2.countNonZero(cv2.bitwise_and(evidence, cv2.bitwise_not(lasting)))
        self._weather += _GAIN_WEATHER * (fleeting / evidence.size - self._weather)
        if self._weather <= _WEATHER:
            return None
        shown = cv2.bitwise_and(evidence, lasting)
        return np.asarray(cv2.morphologyEx(shown, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)))

    def _moving(
        self, gray: NDArray[np.uint8], seconds: float, step: WorldMotion
    ) -> NDArray[np.uint8]:
        """Return where something moves now against the world, (h, w) uint8 0/255."""
        frames = self._recent
        for each in frames:
            each.motion = WorldMotion.over([each.motion, step])
        frames.append(_Recent(seconds, gray, WorldMotion()))
        while len(frames) > 2 and seconds - frames[1].seconds >= _GAP_S:
            frames.popleft()
        before, motion = frames[0].gray, frames[0].motion
        level = _SPREADS * self._view.background.sigma
        if motion.camera is None:
            difference = cv2.absdiff(gray, before)
        else:
            before = motion.warped(before, _all_of(gray))
            shown = motion.warped(np.full_like(gray, 255), _all_of(gray), cv2.BORDER_CONSTANT)
            shown = cv2.erode(shown, _EDGE)
            difference = cv2.bitwise_and(cv2.absdiff(gray, before), shown)
            difference = cv2.subtract(
                difference, _of_misplacement(before, difference, shown, level)
            )
        _, moving = cv2.threshold(difference, level, 255, cv2.THRESH_BINARY)
        return np.asarray(cv2.medianBlur(moving, 3))

    def _compare(self, lab: NDArray[np.uint8], moving: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return how surely each pixel is no background, (h, w) uint8."""
        unknown = np.where(moving > 0, np.uint8(_UNKNOWN), np.uint8(0))
        if not self._view.is_known:
            return unknown
        logit = self._view.smoothed().evidence(lab, _all_of(lab), _SHADOW_FLOOR)
        likelihood = np.clip(127.5 + _GAIN * logit, 0, 255).astype(np.uint8)
        return np.where(logit == 0, unknown, likelihood)

    def _learn(self, filled: NDArray[np.uint8], seconds: float) -> None:
        """
        Learn the background now and then.

        :param filled: (h, w) uint8 of the searched image, non-zero where it cannot be seen.
        """
        self._begun = self._begun or seconds
        known_s = seconds - self._begun
        wait = min(_SHARE * known_s, _PERIOD_S)
        # Before that it is not known what moves.
        if known_s < _GAP_S or seconds - self._learnt < wait:
            return
        self._learnt = seconds
        side = 2 * max(1, round(_MARGIN * filled.shape[0])) + 1
        self._view.learn_all(np.asarray(cv2.dilate(filled, np.ones((side, side), np.uint8))))


def _of_misplacement(
    before: NDArray[np.uint8],
    difference: NDArray[np.uint8],
    shown: NDArray[np.uint8],
    level: float,
) -> NDArray[np.uint8]:
    """
    Return what of a difference may be there because the world is not quite where it should be.

    Parallax, blur and a rolling shutter put edges off by a part of a pixel, or more: by the median
    of those of the frame, of which people are the lesser part.

    :param before: (h, w) uint8, the lightness of an earlier frame as it should look now.
    :param difference: (h, w) uint8, from the newest frame.
    :param shown: (h, w) uint8, non-zero where both can be seen.
    :param level: difference that is noise.
    """
    around = np.ones((3, 3), np.uint8)
    span = cv2.subtract(cv2.dilate(before, around), cv2.erode(before, around))
    some = slice(None, None, 2), slice(None, None, 2)
    steep = (span[some] > _STEEP * level) & (shown[some] > 0)
    if np.count_nonzero(steep) < _LEAST_STEEP:
        return np.zeros_like(before)
    places = difference[some][steep] / span[some][steep].astype(np.float32)
    return np.asarray(cv2.convertScaleAbs(span, alpha=_SPREADS * float(median(places))))


def _all_of(image: NDArray[np.uint8]) -> Window:
    """Return all rows and columns of an image."""
    return slice(0, image.shape[0]), slice(0, image.shape[1])
