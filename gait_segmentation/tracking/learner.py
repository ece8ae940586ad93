# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One person taught by the masks that come back: colours, place, size, outline and look."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import BodyFrame
from gait_segmentation.images import Window, bounding_box
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.features import FeatureSelector
from gait_segmentation.tracking.judgement import view_of
from gait_segmentation.tracking.person.learning import (
    WholeArea,
    grown,
)
from gait_segmentation.tracking.person.person import Person
from gait_segmentation.tracking.records import Record
from gait_segmentation.tracking.recovery.hiding import Hiding
from gait_segmentation.tracking.recovery.lost_and_found import LostAndFound
from gait_segmentation.tracking.world import World

__all__ = ['Learner', 'Learnt']

_ALL = 0.95
"""Share of the usual area from which nothing hides any of the person."""

_PART, _LATELY_S = 0.75, 0.7
"""
Share of it below which a mask shows only a part, and for how long after that the place of the body
may still be wrong.
"""


@dataclass(frozen=True)
class Learnt:
    """
    What a mask that was learnt from told, in the frame it belongs to.

    ``mask`` and ``template`` are (H, W) uint8 of the working image, ``strange`` (h, w) uint8 of
    the window about the person, non-zero on what is not the known background.  ``margin`` is a
    window and (h, w) uint8 of it, the mask with a margin: where the person may be.  ``share`` is
    the area of the mask over what is usual; ``lately_part`` tells whether this mask or one shortly
    before showed only a part of the person.
    """

    window: Window
    mask: NDArray[np.uint8]
    margin: tuple[Window, NDArray[np.uint8]]
    template: NDArray[np.uint8]
    strange: NDArray[np.uint8]
    share: float
    lately_part: bool


@dataclass(frozen=True)
class _Lesson:
    """
    A mask that came back, and its frame about the person.

    ``lab`` is (h, w, 3) uint8 and ``strange`` (h, w) uint8 of the window, ``mask`` and
    ``template`` are (H, W) uint8.  ``alone`` tells whether nobody else who is tracked is near,
    ``company`` whether somebody without a slot may be in the way.
    """

    record: Record
    window: Window
    lab: NDArray[np.uint8]
    strange: NDArray[np.uint8]
    mask: NDArray[np.uint8]
    template: NDArray[np.uint8]
    alone: bool
    company: bool

    @cached_property
    def familiar(self) -> NDArray[np.bool_]:
        """Return where the window looks as the background is known to, or as its shadow."""
        return self.record.background.is_sure(self.window) & (self.strange == 0)

    @cached_property
    def hiding(self) -> Hiding:
        """Return what stands before the person: the known background, or who passes by."""
        window = self.window
        before = self.familiar.copy()
        for other in self.record.passers_by.values():
            before |= other.enlarged(window) > 0
        return Hiding.of(window, self.mask, self.template, before)


class Learner:
    """
    Takes in the masks of a person who is tracked.

    Nothing is learnt of colours, size and look from a mask that shows only part of somebody who
    is not at the border, but the person is followed by that part.
    """

    def __init__(
        self, person: Person, world: World, features: FeatureSelector, memory: LostAndFound
    ) -> None:
        """Begin with the person's first mask."""
        self._person = person
        self._world = world
        self._features = features
        self._memory = memory
        self._area = WholeArea(person)
        self._part_ns: int | None = None

    def hide(self) -> None:
        """Take the next masks for those of somebody hidden in part, until one is whole."""
        self._area.hide()

    def skip(self, record: Record) -> None:
        """Let go of a frame that is never learnt: only its motion counts."""
        if self._person.track_id in record.bodies:
            self._person.carry(*record.bodies[self._person.track_id])

    def learn(
        self,
        record: Record,
        mask: NDArray[np.uint8],
        prior: NDArray[np.uint8],
        body: BodyFrame | None,
        config: TrackingConfig,
        *,
        alone: bool,
    ) -> Learnt | None:
        """
        Learn from the mask of a frame just taken out of the world.

        :param mask, prior: (h, w) uint8 at working size, the mask 0/255, and the template; they
            are kept and drawn on.
        :param body: the matched body in source pixels.
        :param alone: whether nobody else is near.
        :returns: what it told; None if the mask says nothing.
        """
        person, world = self._person, self._world
        if not person.teaches(mask, prior):
            self.skip(record)
            person.part = mask
            return None
        dx, dy = world.since_mask(person.track_id)
        person.shift(-dx, -dy)
        window = person.window(world.shape)
        lab = record.image.lab_part(window)
        strange = record.strange(window, config.shadow_floor, lab)
        company = person.track_id in record.company
        lesson = _Lesson(record, window, lab, strange, mask, prior, alone, company)
        whole = self._area.update(
            mask,
            prior,
            person,
            alone=alone,
            company=company,
            hidden=lambda: lesson.hiding.much,
        )
        part = mask if self._area.share > _ALL else lesson.hiding.away(mask)
        if whole:
            person.take(mask, prior, part)
            scaled = None if body is None else body.scaled(world.scale)
            margin = self._learn_all(lesson, scaled, config)
        else:
            self.skip(record)
            person.part = part
            margin = self._about_part(lesson)
        person.shift(dx, dy)
        if not (whole or alone):
            return None
        share, stamp_ns = self._area.share, record.image.stamp_ns
        if share < _PART:
            self._part_ns = stamp_ns
        lately = self._part_ns is not None and stamp_ns - self._part_ns < _LATELY_S * 1e9
        return Learnt(window, mask, margin, prior, strange, share, lately)

    def _learn_all(
        self, lesson: _Lesson, body: BodyFrame | None, config: TrackingConfig
    ) -> tuple[Window, NDArray[np.uint8]]:
        """
        Learn from a mask of all of the person.

        :param body: the matched body in working pixels.
        :returns: the mask with a margin.
        """
        person, record, window = self._person, lesson.record, lesson.window
        mask, rate = lesson.mask, config.colour_rate
        if config.use_feature_selection:
            self._features.learn(view_of(record, window), mask[window], rate)
        person.learn_colours(
            lesson.lab, window, mask, lesson.template, rate, lesson.strange, lesson.familiar
        )
        bounds = bounding_box(mask)
        margin = grown(mask, person.height, bounds)
        person.learn_place(mask, body, bounds, record.rows.get(person.track_id))
        if config.use_tilt:
            person.learn_angle(mask, bounds)
        self._memory.learn_look(person, record, bounds)
        return margin

    def _about_part(self, lesson: _Lesson) -> tuple[Window, NDArray[np.uint8]]:
        """
        Return where somebody half hidden may be: in this mask, the last whole one, the template.

        What the person uncovers meanwhile is learnt as background, or it would trail behind.
        """
        window = lesson.window
        where = np.zeros(self._world.shape, np.uint8)
        about = self._person.mask[window] | lesson.mask[window]
        where[window] = about | cv2.inRange(lesson.template[window], 128, 255)
        return grown(where, self._person.height)
