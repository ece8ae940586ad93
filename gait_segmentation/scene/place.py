# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
What the place before a camera looks like without people, all over the image and made small.

It is learnt where nothing moves, by the difference from a moment ago and from what is known, so
that no empty scene is needed: before it, the first mask of a person who begins is estimated.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import Box
from gait_segmentation.images import median
from gait_segmentation.scene.ego_motion import WorldMotion
from gait_segmentation.scene.scene import Scene, WholeView

SEARCHED_PX = 256
"""Longest side of the image that the place is remembered in, in pixels."""

# For several people up to this scale of the source, and this longest side.
_FINE_SCALE = 0.375
_FINE_PX = 480
_KEPT_NS = 400_000_000  # pause after which the place is learnt anew
# Time between two frames that are taken in: more often tells hardly more.
_PERIOD_NS = 95_000_000
_GAP_NS = 140_000_000  # between the two frames whose difference shows what moves now
_STILL_SPREADS = 2.0  # least difference that is motion, in spreads of a still pixel
# Range of lightness about a pixel from which it tells by how much the place is off, in times of
# the least difference; and the number of such pixels that are needed.
_STEEP_LEVELS = 4.0
_LEAST_STEEP = 50
_AROUND = np.ones((3, 3), np.uint8)
# Rim of a warped frame that is not compared, and of what moves that is not learnt.
_RIM = np.ones((5, 5), np.uint8)
# How near something must have been in the frame before that is not fleeting, the share of the
# image that is fleeting in rain or snow, in the mean of some frames, and what one counts in it.
_NOT_FLEETING = np.ones((3, 7), np.uint8)
_WEATHER = 0.04
_GAIN_WEATHER = 0.2
_SHADOW_FLOOR = 0.6  # darkest shadow, as a share of the background's lightness; clothes are darker
_BROKEN = 0.5  # share of pixels that differ at which the place is not the one learnt
_LEAST_AREA = 10  # pixels of what moves
_MOST_PARTS = 32  # that may move, the largest ones
_MOVING_SHARE = 0.3  # of a person's box, in which they move


class PlaceMemory:
    """Learns the place of a scene beside what moves, before a camera that may move."""

    def __init__(self, scene: Scene, *, fine: bool = False) -> None:
        """
        Begin with the newest frame of a scene.

        :param fine: whether to look more closely, as several people may be small.
        """
        size = max(scene.source)
        longest = max(SEARCHED_PX, min(_FINE_SCALE * size, _FINE_PX)) if fine else SEARCHED_PX
        self._scene, self._view = scene, WholeView(scene.source, min(1.0, longest / size))
        scene.add(self._view)
        self._last = self._view.now
        self.stamp_ns = 0
        """That of the newest frame taken in."""

        self._forget()

    def _forget(self) -> None:
        self._view.clear()
        self._evidence = self._bodies = np.zeros(self._view.shape, np.uint8)
        self._weather = self._begun = 0.0

    def close(self) -> None:
        """Let the scene go on without the view of all of it."""
        self._scene.moving = None
        self._scene.views = [each for each in self._scene.views if each is not self._view]

    @property
    def known(self) -> WholeView | None:
        """Return the view of all of the scene, None if nothing is known of it."""
        return self._view if self._view.is_known else None

    def moves(self, box: Box) -> bool:
        """Return whether a box, in source pixels, shows somebody unknown who moves."""
        height, width = self._view.shape
        part = self._bodies[box.scaled(self._view.scale).slices(width, height)]
        return cv2.countNonZero(part) > _MOVING_SHARE * part.size

    def is_old(self, stamp_ns: int) -> bool:
        """Return whether no frame was taken in for so long that the place may be another one."""
        return stamp_ns - self.stamp_ns >= _KEPT_NS

    def update(self, people: Sequence[Box] = ()) -> None:
        """
        Take in the newest frame of the scene, and what moves in it.

        :param people: boxes of who is known there, in source pixels.
        """
        view = self._view
        if self._scene.stamp_ns - self.stamp_ns < _PERIOD_NS:
            return
        self.stamp_ns = self._scene.stamp_ns
        taken = [box.scaled(view.scale) for box in people]
        now, (height, width) = view.now, view.shape
        # More frames may have come than are kept.
        last = self._last if self._last in view.frames else view.frames[0]
        step, self._last = view.motion_since(last), now
        lab = np.asarray(cv2.blur(now.image.lab, (3, 3)))
        moving = self._moving(lab)
        evidence = moving.copy()
        if view.is_known:
            evidence[view.smoothed().evidence(lab, _SHADOW_FLOOR) > 0] = 255
        windows = [box.slices(width, height) for box in taken]
        for window in windows:
            evidence[window] = moving[window] = 0
        fresh = cv2.countNonZero(evidence) > _BROKEN * evidence.size
        if fresh:
            self._forget()
            evidence[:] = 0
        lasting = self._lasting(evidence, step)
        if lasting is not None:
            evidence, moving = (cv2.bitwise_and(each, lasting) for each in (evidence, moving))
        self._bodies = moving_bodies(evidence, moving)
        filled = self._bodies.copy()
        for window in windows:
            filled[window] = 255
        self._scene.moving = filled
        self._learn(filled, now.image.stamp_ns / 1e9)

    def _lasting(self, evidence: NDArray[np.uint8], step: WorldMotion) -> NDArray[np.uint8] | None:
        """Return what was there in the last frame, too, (h, w) uint8, None in fair weather."""
        before, self._evidence = self._evidence, evidence
        lasting = cv2.dilate(step.warped(before, self._view.all), _NOT_FLEETING)
        fleeting = cv2.countNonZero(cv2.bitwise_and(evidence, cv2.bitwise_not(lasting)))
        self._weather += _GAIN_WEATHER * (fleeting / evidence.size - self._weather)
        if self._weather <= _WEATHER:
            return None
        shown = cv2.bitwise_and(evidence, lasting)
        return np.asarray(cv2.morphologyEx(shown, cv2.MORPH_OPEN, _AROUND))

    def _moving(self, lab: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return where something moves now against the world, (h, w) uint8 0/255."""
        view, gray = self._view, np.ascontiguousarray(lab[..., 0])
        since_ns = view.now.image.stamp_ns - _GAP_NS
        earlier = [each for each in view.frames if each.image.stamp_ns <= since_ns]
        frame = earlier[-1] if earlier else view.frames[0]
        motion, level = view.motion_since(frame), _STILL_SPREADS * view.background.sigma
        before = np.asarray(cv2.blur(np.ascontiguousarray(frame.image.lab[..., 0]), (3, 3)))
        if motion.camera is None:
            difference = cv2.absdiff(gray, before)
        else:
            before = motion.warped(before, view.all)
            shown = motion.warped(np.full_like(gray, 255), view.all, cv2.BORDER_CONSTANT)
            difference = cv2.bitwise_and(cv2.absdiff(gray, before), cv2.erode(shown, _RIM))
            # Parallax, blur and a rolling shutter put edges off by a part of a pixel, or more: by
            # the median of those of the frame, of which people are the lesser part.
            span = cv2.morphologyEx(before, cv2.MORPH_GRADIENT, _AROUND)
            some, spans = difference[::2, ::2], span[::2, ::2].astype(np.float32)
            steep = (spans > _STEEP_LEVELS * level) & (some > 0)
            if np.count_nonzero(steep) >= _LEAST_STEEP:
                off = _STILL_SPREADS * float(median(some[steep] / spans[steep]))
                difference = cv2.subtract(difference, cv2.convertScaleAbs(span, alpha=off))
        _, moving = cv2.threshold(difference, level, 255, cv2.THRESH_BINARY)
        return np.asarray(cv2.medianBlur(moving, 3))

    def _learn(self, filled: NDArray[np.uint8], seconds: float) -> None:
        """Learn the background where (h, w) uint8 is zero, once it is known what moves."""
        self._begun = self._begun or seconds
        if seconds - self._begun >= _GAP_NS / 1e9:
            self._view.add_all(np.asarray(cv2.dilate(filled, _RIM)))


def moving_bodies(evidence: NDArray[np.uint8], moving: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """
    Return the bodies that move in a frame, (h, w) uint8 0/255.

    They are connected components, filled row by row between their outermost moving pixels.

    :param evidence: (h, w) uint8, non-zero where something is that is no background.
    :param moving: (h, w) uint8, non-zero where something moves now.
    """
    closed = cv2.morphologyEx(evidence, cv2.MORPH_CLOSE, np.ones((5, 3), np.uint8))
    # Labels of 16 bits are three times as fast; 480 x 480 pixels cannot hold more.
    count, labels, stats, _ = cv2.connectedComponentsWithStats(
        closed, connectivity=8, ltype=cv2.CV_16U
    )
    parts = [k for k in range(1, count) if stats[k, cv2.CC_STAT_AREA] >= _LEAST_AREA]
    parts.sort(key=lambda k: -stats[k, cv2.CC_STAT_AREA])
    filled = np.zeros_like(evidence)
    for part in parts[:_MOST_PARTS]:
        window = Box(*stats[part, :4].tolist()).slices(evidence.shape[1], evidence.shape[0])
        body = (labels[window] == part) & (evidence[window] != 0)
        moves = body & (moving[window] != 0)
        if not moves.any():
            continue
        between = np.logical_or.accumulate(moves, axis=1)
        between &= np.logical_or.accumulate(moves[:, ::-1], axis=1)[:, ::-1]
        filled[window][between] = 255
    return filled
