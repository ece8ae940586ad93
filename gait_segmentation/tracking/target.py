# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One tracked person in a world: followed, judged, assessed, learnt."""

from __future__ import annotations

import math
from copy import copy

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.ego_motion.world_motion import WorldMotion
from gait_segmentation.geometry import Box
from gait_segmentation.images import Window, placed, shift_whole
from gait_segmentation.results import LOST, TRACKED, Feedback, TrackResult
from gait_segmentation.starting import Start
from gait_segmentation.tracking.competition import Claim
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.features import FeatureSelector
from gait_segmentation.tracking.judgement import judge, view_of
from gait_segmentation.tracking.learner import Learner, Learnt
from gait_segmentation.tracking.likelihood.log_ratio import likelihood_image
from gait_segmentation.tracking.mean_shift import mean_shift
from gait_segmentation.tracking.person.appearance import Appearance
from gait_segmentation.tracking.person.learning import working_masks
from gait_segmentation.tracking.person.pace import STEADY_AFTER, is_astray
from gait_segmentation.tracking.person.person import Person, new_colours
from gait_segmentation.tracking.records import Record
from gait_segmentation.tracking.recovery.guard import Guard
from gait_segmentation.tracking.recovery.lost_and_found import LostAndFound
from gait_segmentation.tracking.recovery.visibility import (
    CLEAR_ENOUGH,
    LOST_BELOW,
    Sight,
    Visibility,
    likely_rows,
    visible_box,
)
from gait_segmentation.tracking.world import World

__all__ = ['Target']

_REACH = 0.7
"""How far about the middle of the body the window may reach, in body heights."""

_ALONE = 0.9
"""Share that must not be hidden by others, so that what hides the rest is the background."""

_STEADY_RATE = 1 / 3
"""Share of the usual by which the pace changes while somebody else is near."""

_LEAST_STEP_S = 0.005
"""Frames whose stamps are closer have not been taken in so short a time: no pace is learnt."""

_MOST_MEAN_SHIFT = 0.05
"""Largest mean shift in a frame, in body heights."""

Likelihood = NDArray[np.uint8]


class Target:
    """
    A person in one slot.

    ``state`` is tracked or lost.  Nothing is learnt of somebody lost;
    see :mod:`gait_segmentation.tracking.recovery.lost_and_found`.
    """

    def __init__(self, track_id: int, world: World, start: Start, config: TrackingConfig) -> None:
        """Begin with the first mask, in the world's newest frame."""
        self.track_id = track_id
        self.world = world
        self.config = config
        self.state = TRACKED
        self.confidence = 0.0
        self.person = Person(
            track_id,
            start.body.center_x,
            start.body.center_y,
            start.body.height,
            max(start.body.center_x - start.box.x, 1.0),
            max(start.box.right - start.body.center_x, 1.0),
            start.mask,
            *new_colours(config),
        )
        if config.use_tilt:
            self.person.tilt = self.person.angle = start.body.angle
        self.features = FeatureSelector()
        if config.use_feature_selection:
            window = self.person.window(world.shape)
            self.features.learn(view_of(world.now, window), start.mask[window], 1.0)
        self.person.learn_first_colours(world.now.image.lab, start.votes)
        world.now.bodies[track_id] = (0.0, 0.0)
        self._first = True
        self._box: Box | None = None
        self._visibility = Visibility()
        self._uncovered = True
        self._memory = LostAndFound(self.person, world.now)
        self._learner = Learner(self.person, world, self.features, self._memory)
        self._guard = Guard()

    @property
    def box(self) -> Box:
        """Return the box about what can be seen, in source pixels."""
        return self._box if self._box is not None else self.body

    @property
    def body(self) -> Box:
        """Return the box of the whole body in source pixels, in the frame of the body."""
        return self.person.box.scaled(1 / self.world.scale)

    @property
    def feet(self) -> float:
        """Return the row of the soles in working pixels: the lower, the nearer."""
        return self.person.center_y + self.person.height / 2

    @property
    def _accompanied(self) -> bool:
        return self.track_id in self.world.now.company

    @property
    def appearance(self) -> Appearance:
        """Return what the person looks like."""
        return self._memory.appearance

    @property
    def lost_s(self) -> float:
        """Return for how many seconds the person has been lost."""
        return self._memory.lost_s

    def meets(self, other: Target) -> bool:
        """Return whether another person may be in the way of this one, or the other way round."""
        one, two = self.person, other.person
        reach = _REACH * (one.height + two.height)
        return (
            abs(one.center_x - two.center_x) < reach and abs(one.center_y - two.center_y) < reach
        )

    def likeness(self, world: World, start: Start) -> float:
        """Return how alike (0..1) the colours of a first mask in a world's newest frame are."""
        return self._memory.likeness(start, world.now)

    @property
    def window(self) -> Window:
        """Return the rows and columns about the person in the working image."""
        return self.person.window(self.world.shape)

    def carried_mask(self) -> NDArray[np.uint8]:
        """Return the last mask, carried along with the body, in the window about the person."""
        if self.state == LOST:
            return self._memory.silhouette.placed(self.person, self.world.shape)[self.window]
        return self.world.carried(self.person.mask, self.track_id, self.window)

    def carried_part(self) -> NDArray[np.uint8]:
        """Return what of the person can be followed, as the last mask showed it, likewise."""
        return self.world.carried(self.person.part, self.track_id, self.window)

    # Each frame: move, judge, assess, and if lost, recover.

    def move(
        self, motion: WorldMotion, body: NDArray[np.uint8] | None, *, company: bool = False
    ) -> None:
        """
        Follow the body into the world's newest frame.

        :param motion: of the world.
        :param body: what can be followed carried to the frame before, in the window about the
            person, without what others hid there; None of somebody lost.
        :param company: whether somebody without a slot may be in the way.
        """
        person = self.person
        x, y = motion.carry(person.center_x, person.center_y)
        world = (x - person.center_x, y - person.center_y)
        seconds = self.world.step_s
        if company:
            self.world.now.company.add(self.track_id)
        if body is None:
            shift = self._memory.coast(person, world, seconds, self.world.shape)
        else:
            shift = self._follow(world, seconds, body)
            self._guard.carry(world, seconds)
        self.world.now.bodies[self.track_id] = shift

    def _follow(
        self,
        world: tuple[float, float],
        seconds: float,
        body: NDArray[np.uint8],
    ) -> tuple[float, float]:
        person, pace = self.person, self._memory.pace
        # Of the step between the frames before, which need not have been as long.
        ratio = self.world.step_ratio
        person.velocity = (ratio * person.velocity[0], ratio * person.velocity[1])
        # Of somebody behind others it may be their motion.
        follow = self._visibility.well or self._uncovered
        measured = None
        if follow:
            measured = self.world.body_shift(body, self.window, person.velocity)
        way = (pace[0] * seconds, pace[1] * seconds)
        usual = (world[0] + way[0], world[1] + way[1])
        known = person.moves >= STEADY_AFTER
        if (
            known
            and measured is not None
            and is_astray(
                measured,
                usual,
                math.hypot(*way),
                person.height,
                company=self._accompanied,
                hidden=not self._visibility.well,
            )
        ):
            measured = None
        if measured is None:
            person.velocity = way
        shift = person.predict(world, measured)
        if measured is not None and seconds > _LEAST_STEP_S:
            share = _STEADY_RATE if known and self._accompanied else 1.0
            x, y = (u + share * (s - u) for s, u in zip(shift, usual, strict=True))
            self._memory.learn_pace((x, y), world, seconds)
        return shift

    def judge(self) -> Claim | None:
        """Judge the pixels in a window about the person, None if all of it is outside."""
        person, seen = self.person, self.state == TRACKED
        expected = self.carried_mask()
        judged = judge(
            person,
            self.world,
            self.features,
            expected,
            self.config,
            seen=seen,
            propagate=self.config.use_propagation or self._first,
        )
        if judged is None:
            return None
        self._first = False
        window, logit, near = judged
        return Claim(window, logit, expected, near, self.feet, person.height, not seen)

    def assess(
        self, likelihood: Likelihood, claim: Claim, cover: NDArray[np.uint8] | None
    ) -> None:
        """
        See how well the person stands out, and refine the place by mean shift.

        :param likelihood: (h, w) uint8 of the working image.
        :param claim: what was made of the pixels where the person is expected.
        :param cover: (h, w) uint8 of its window, non-zero where others hide the person.
        """
        window = claim.window
        values = likelihood[window]
        sight = Sight.of(values, claim.mask, cover)
        self.confidence = sight.confidence
        self._uncovered = sight.share > _ALONE
        clear = 0.0
        if sight.seen < LOST_BELOW and self._uncovered:
            clear = self._clear(sight, values, claim, cover)
        inside = self.person.share_inside(self.world.shape)
        if not self._visibility.update(sight.seen, inside, clear):
            if self._visibility.is_lost:
                self.lose()
            return
        if self._visibility.well and not self._accompanied:
            # Likely pixels of both would pull the person towards the other.
            self._mean_shift(values, sight.uncovered, window)
        self._box = self._box_of(values, sight, claim)
        person = self.person
        center = (person.center_x - window[1].start, person.center_y - window[0].start)
        rows = likely_rows(values, claim.near, center, person.height, person.angle)
        if rows is not None:
            self.world.now.rows[self.track_id] = rows

    def _clear(
        self, sight: Sight, values: Likelihood, claim: Claim, cover: NDArray[np.uint8] | None
    ) -> float:
        """
        Return the share of the person that cannot be anything else.

        In the last mask, or else in that and the template: a mask ends at the pole that the body
        goes on behind, to come forth on its other side.
        """
        clear = self._before(sight, values, claim.window).seen
        template = self.person.template
        if clear >= CLEAR_ENOUGH or template is None:
            return clear
        body = self.world.carried(template, self.track_id, claim.window)
        whole = cv2.bitwise_or(claim.mask, cv2.inRange(body, 128, 255))
        return self._before(Sight.of(values, whole, cover), values, claim.window).seen

    def _before(self, sight: Sight, values: Likelihood, window: Window) -> Sight:
        """Return the sight of what does not look like the known background."""
        record = self.world.now
        return sight.before(record.strange(window, self.config.shadow_floor), values)

    def lose(self) -> None:
        """Give the person up for lost."""
        self.state = LOST
        self.person.template = None
        self._memory.begin_search()
        if self._guard.in_doubt:
            self._guard.bring_back(self.person, self._memory)
        self._learner.hide()
        self._visibility.restart()
        self._box = None

    def _mean_shift(
        self, values: NDArray[np.uint8], reference: NDArray[np.uint8], window: Window
    ) -> None:
        person = self.person
        box = person.box.shifted(-window[1].start, -window[0].start)
        shift = mean_shift(
            values,
            reference,
            (round(box.x), round(box.y), max(round(box.width), 1), max(round(box.height), 1)),
        )
        gain = self.config.mean_shift_gain
        limit = _MOST_MEAN_SHIFT * person.height
        dx = gain * min(max(shift.dx, -limit), limit)
        dy = gain * min(max(shift.dy, -limit), limit)
        self._shift_now(dx, dy)
        if len(self.world.pending) > 1:
            # The last mask is not of the last frame: until a newer one comes, this is the size.
            person.follow_scale(shift.scale)

    def _shift_now(self, dx: float, dy: float) -> None:
        """Correct the place in the newest frame."""
        self.person.shift(dx, dy)
        body = self.world.now.bodies[self.track_id]
        self.world.now.bodies[self.track_id] = (body[0] + dx, body[1] + dy)

    def _box_of(self, values: NDArray[np.uint8], sight: Sight, claim: Claim) -> Box | None:
        """Return the tight box of the likely pixels near the mask, in source pixels."""
        height = self.person.height
        box = visible_box(values, sight.uncovered, claim.near, claim.window, height)
        return None if box is None else box.scaled(1 / self.world.scale)

    def recover(
        self, claim: Claim | None, likelihood: Likelihood | None, taken: NDArray[np.uint8]
    ) -> Likelihood | None:
        """
        Look for the person who is lost: where expected, then all over the image.

        :param claim: what was judged where the person is expected, and the likelihood after
            competing with others; None if that is outside.
        :param taken: non-zero where others are.
        :returns: the likelihood if the person was found; the state is then tracked.
        """
        world = self.world
        others = world.passers_by.who_is_not(self.track_id, world.pending, world.shape)
        if others is not None:
            taken = taken | others
        if claim is not None and likelihood is not None and self._shows(claim, likelihood, taken):
            return likelihood
        place = self._memory.search(self.person, self.world, taken, self.config)
        if place is None:
            return None
        bodies = self.world.now.bodies
        before = (self.person.center_x, self.person.center_y)
        body = bodies[self.track_id]
        dx, dy, partly = place
        self._shift_now(dx, dy)
        claim = self.judge()
        if claim is not None:
            likelihood = likelihood_image(claim.logit, claim.window, self.world.shape)
            likelihood[taken > 0] = 0
            if self._shows(claim, likelihood, taken, partly=partly):
                return likelihood
        self.person.center_x, self.person.center_y = before
        bodies[self.track_id] = body
        return None

    def _shows(
        self,
        claim: Claim,
        likelihood: Likelihood,
        taken: NDArray[np.uint8],
        *,
        partly: bool = False,
    ) -> bool:
        """
        Return whether the person, and nobody else, can be seen at the place.

        :param partly: whether only what stands out before the known background counts.
        """
        if self.person.share_inside(self.world.shape) < LOST_BELOW:
            return False
        window = claim.window
        values, rivals = likelihood[window], taken[window]
        sight = Sight.of(values, claim.mask, rivals, rivals)
        self.confidence = sight.confidence
        likely = np.zeros(self.world.shape, np.uint8)
        likely[window] = np.where(values > 127, sight.uncovered, 0)
        part = self._before(sight, values, window) if sight.share > _ALONE else None
        now = self.world.now
        if not self._memory.is_found(self.person, sight, part, likely, now, partly=partly):
            return False
        dx, dy = self.world.since_mask(self.track_id)
        expected = placed(claim.mask, window, self.world.shape)
        self.person.take(shift_whole(expected, round(-dx), round(-dy)), None)
        self.state = TRACKED
        self.person.learnt_anew = 0
        self._guard.found(self.person)
        self._visibility.seen = sight.seen
        self._box = self._box_of(values, sight, claim)
        return True

    def result(self, likelihood: Likelihood) -> TrackResult:
        """Return what is known in the newest frame."""
        seen = self.state == TRACKED
        source = self.world.source
        return TrackResult(
            self.world.now.image.stamp_ns,
            self.track_id,
            (self.box.clipped(source[1], source[0]) or self.body) if seen else None,
            likelihood,
            self.confidence,
            self.person.angle,
            self.state,
            self.body if seen else None,
            self.features.features if seen else (),
        )

    # Feedback.

    def skip(self, record: Record) -> None:
        """Let go of a frame that is never learnt: only its motion counts."""
        if self.state == TRACKED:
            self._learner.skip(record)

    def learn(
        self, record: Record, feedback: Feedback | None, *, alone: bool = True
    ) -> Learnt | None:
        """
        Learn from the mask of a frame just taken out of the world, if one came back.

        :param alone: whether nobody else is near.
        :returns: what it told; None if the mask says nothing.
        """
        if feedback is None or self.state == LOST:
            self.skip(record)
            return None
        mask, prior = working_masks(feedback, self.world.shape)
        self._part(record, mask)
        learnt = self._learner.learn(record, mask, prior, feedback.body, self.config, alone=alone)
        if learnt is None or not alone or not self._is_other(record, learnt):
            return learnt
        return None if self._turn_back(record, learnt) else learnt

    def _part(self, record: Record, mask: NDArray[np.uint8]) -> None:
        """Take somebody else whom a mask of working size shows, too, out of it."""
        world = self.world
        since = world.since_mask(self.track_id)
        others = self._guard.others_in(self.person, self._memory, record, mask, since)
        if others is not None:
            mask[others > 0] = 0
            world.passers_by.leave(mask)
            world.passers_by.welcome(others, since, record, self.person, self.config)

    def _is_other(self, record: Record, learnt: Learnt) -> bool:
        """Return whether the body that is followed seems to be somebody else's."""
        return self._guard.is_other(
            self.person,
            self._memory,
            record,
            learnt.window,
            learnt.mask,
            self.world.since_mask(self.track_id),
            learnt.share,
            about=self.world.passers_by.walking,
        )

    def _turn_back(self, record: Record, learnt: Learnt) -> bool:
        """
        Look for the person elsewhere, as the person was before.

        :returns: whether the person was found; the body that was followed is then that of
            somebody without a slot.  Else all is as it was.
        """
        person, memory, world = self.person, self._memory, self.world
        since = world.since_mask(self.track_id)
        followed = person.snapshot()
        before = memory.snapshot(), copy(self._visibility), self.confidence, self._box
        body = world.now.bodies[self.track_id]
        self._guard.bring_back(person, memory)
        self.state, person.template = LOST, None
        taken = shift_whole(learnt.mask, round(since[0]), round(since[1]))
        if self.recover(None, None, taken) is not None:
            self._learner.hide()
            self._visibility.restart()
            world.passers_by.forget()
            world.passers_by.welcome(learnt.mask, since, record, followed.state, self.config)
            return True
        person.restore(followed)
        memory.restore(before[0])
        self._visibility, self.confidence, self._box = before[1:]
        self.state = TRACKED
        world.now.bodies[self.track_id] = body
        return False
