# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Distractors: people without a slot beside somebody tracked.

A colour never seen before is no colour of the background, and so it would be the tracked person's.
So what is large, is not the known background, moves, and stands apart from the person is a track
of its own.  It is followed and competes for pixels as all do; its mask is what it wins.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import BodyFrame, Box
from gait_segmentation.images import Window, bounding_box, overlap, placed
from gait_segmentation.results import LOST
from gait_segmentation.starting import Start
from gait_segmentation.tracking.background.kernels import SURE_COUNT
from gait_segmentation.tracking.learner import Learnt
from gait_segmentation.tracking.person.learning import MARGIN, WHOLE
from gait_segmentation.tracking.person.person import LEAST_SEEN
from gait_segmentation.tracking.records import Record
from gait_segmentation.tracking.target import Target

__all__ = ['Surroundings']

_LEAST_HEIGHT, _ASIDE = 0.35, 0.25
"""
Height of what is somebody else, and distance of its middle from the person's axis, in body heights
of the person near: an arm or a bag that was missed is nearer.
"""

_APART = 0.08
"""
Distance from the template from which nothing is the person's, and from a distractor up to which
what else is strange belongs to it, in body heights.
"""

_MOVING = 0.2
"""Least share that must move: what only differs is grass, or stands nearer than the background."""

_PATIENCE_S = 1.0
"""
Time after which a distractor is forgotten that is seen only in the place of who is tracked: that
is a part of them which was taken for somebody else.
"""


class Surroundings:
    """What a frame that is learnt tells of what is about the people who are tracked."""

    def __init__(
        self,
        record: Record,
        told: Sequence[tuple[Target, Learnt]],
        people: NDArray[np.uint8],
        busy: NDArray[np.uint8] | None,
    ) -> None:
        """
        Look about people.

        :param told: who is tracked, with what their masks told.
        :param people: (H, W) uint8 of the working image, non-zero where they may be.
        :param busy: (H, W) uint8, non-zero on people and what else moves, None if that is not
            known: then all may move.
        """
        self._record, self._told = record, told
        self._strange = np.zeros(people.shape, np.uint8)
        bodies = np.zeros(people.shape, np.uint8)
        for _, learnt in told:
            self._strange[learnt.window] |= learnt.strange
            bodies |= np.uint8(learnt.template > 127)
        self._moving = np.ones_like(people) if busy is None else busy
        if busy is not None:
            for _, learnt in told:
                # What moves where nothing is known yet.
                unknown = record.background.count[learnt.window] < SURE_COUNT
                self._strange[learnt.window] |= unknown & (busy[learnt.window] > 0)
        self._strange[people > 0] = 0
        self._bodies = bodies
        self._away: NDArray[np.float32] | None = None

    @property
    def away(self) -> NDArray[np.float32]:
        """Return the distance of each pixel from all templates in pixels, (H, W)."""
        if self._away is None:
            bodies = cv2.threshold(self._bodies, 0, 255, cv2.THRESH_BINARY_INV)[1]
            self._away = np.asarray(cv2.distanceTransform(bodies, cv2.DIST_L2, 3))
        return self._away

    def teach(self, distractor: Target) -> bool:
        """
        Teach a distractor by what it won of the frame; return whether it is still there.

        That is who is seen apart from those who are tracked, every now and then, in a window
        about one of them.
        """
        record, person = self._record, distractor.person
        windows = [learnt.window for _, learnt in self._told]
        near = any(overlap(distractor.window, window) for window in windows)
        if distractor.state == LOST or not near:
            return False
        distractor.skip(record)
        found = record.won.get(distractor.track_id)
        if found is not None:
            window, won = found
            about = cv2.dilate(person.mask[window], _square(_APART * person.height))
            apart = self.away[window] >= _APART * person.height
            seen = won | np.uint8(255) * ((about > 0) & (self._strange[window] > 0) & apart)
            area = cv2.countNonZero(seen)
            if np.count_nonzero(seen[apart]) >= LEAST_SEEN * distractor.usual_area:
                distractor.seen_ns = record.image.stamp_ns
            if area >= WHOLE * distractor.usual_area:
                distractor.usual_area = max(float(area), distractor.usual_area)
                self._learn(distractor, window, seen, apart)
        return record.image.stamp_ns - distractor.seen_ns < _PATIENCE_S * 1e9

    def _learn(
        self,
        distractor: Target,
        window: Window,
        seen: NDArray[np.uint8],
        apart: NDArray[np.bool_],
    ) -> None:
        """Learn outline and place from all of a distractor, and colours if it is clear enough."""
        record, person, config = self._record, distractor.person, distractor.config
        person.take(placed(seen, window, distractor.world.shape), None)
        dx, dy = distractor.world.since_mask(distractor.track_id)
        x, _, width, _ = bounding_box(seen)
        person.shift(window[1].start + x + width / 2 - dx - person.center_x, -dy)
        person.left = person.right = width / 2
        clear = np.where(apart, seen, 0).astype(np.uint8)
        if 2 * cv2.countNonZero(clear) > cv2.countNonZero(seen):
            lab = record.image.lab_part(window)
            mask = placed(clear, window, distractor.world.shape)
            person.learn_colours(lab, window, mask, None, config.colour_rate)
        person.shift(dx, dy)

    def newcomers(self, target: Target, learnt: Learnt, known: Sequence[Target]) -> list[Start]:
        """
        Return who is new beside a person.

        :param learnt: what the person's mask told.
        :param known: the distractors known already.
        """
        person, window = target.person, learnt.window
        height = person.height
        if min(learnt.share, person.share_inside(target.world.shape)) < WHOLE:
            return []
        strange = self._strange[window] * np.uint8(255)
        moving = self._moving[window]
        if not _enough(strange, moving, height):
            return []
        strange[self.away[window] < _APART * height] = 0
        for other in known:
            near = cv2.dilate(other.person.mask, _square(_APART * height))
            strange[near[window] > 0] = 0
        strange = cv2.morphologyEx(strange, cv2.MORPH_CLOSE, _square(MARGIN * height))
        strange = cv2.morphologyEx(strange, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
        if not _enough(strange, moving, height):
            return []
        count, parts, stats, centers = cv2.connectedComponentsWithStats(strange, connectivity=4)
        axis = person.center_x - window[1].start
        found: list[NDArray[np.bool_]] = []
        for number in range(1, count):
            part = parts == number
            _, _, _, tall, area = stats[number]
            if (
                tall >= _LEAST_HEIGHT * height
                and abs(centers[number][0] - axis) >= _ASIDE * height
                and np.count_nonzero(moving[part]) >= _MOVING * area
            ):
                found.append(part)
        return [_start(part, target, learnt) for part in found]


def _start(part: NDArray[np.bool_], target: Target, learnt: Learnt) -> Start:
    """Return the start of somebody whose mask is a part of the window about a person."""
    mask = np.zeros(target.world.shape, np.uint8)
    mask[learnt.window][part] = 255
    box = Box.around(mask)
    assert box is not None
    # On the same ground, and as tall, as far as is known.
    person = target.person
    body = BodyFrame(box.center_x, person.center_y, person.height)
    return Start(mask, mask / np.float32(255), box, body, 0.0, 0.0)


def _enough(strange: NDArray[np.uint8], moving: NDArray[np.uint8], height: float) -> bool:
    """Return whether what is strange moves in enough rows to be somebody."""
    rows = cv2.reduce(cv2.bitwise_and(strange, moving), 1, cv2.REDUCE_MAX)
    return cv2.countNonZero(rows) >= _LEAST_HEIGHT * height


def _square(margin: float) -> NDArray[np.uint8]:
    side = 2 * max(1, round(margin)) + 1
    return np.ones((side, side), np.uint8)
