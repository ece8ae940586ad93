# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One tracked person in a world: what is known of them, and where they are expected."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import Box
from gait_segmentation.images import Window, placed, shift_whole
from gait_segmentation.results import LOST, TRACKED, TrackResult
from gait_segmentation.starting import Start
from gait_segmentation.tracking.competition import Claim
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.features import FeatureSelector
from gait_segmentation.tracking.judgement import carried_template, judge, view_of
from gait_segmentation.tracking.learner import Learner
from gait_segmentation.tracking.person.appearance import Appearance
from gait_segmentation.tracking.person.person import Person, PersonSnapshot, new_colours
from gait_segmentation.tracking.records import Record, Shift
from gait_segmentation.tracking.recovery.guard import Guard
from gait_segmentation.tracking.recovery.lost_and_found import LostAndFound, MemorySnapshot
from gait_segmentation.tracking.recovery.visibility import ALONE, Sight, Visibility, visible_box
from gait_segmentation.tracking.world import World

__all__ = ['Target', 'TargetSnapshot', 'Whereabouts']

_REACH = 0.7
"""How far about the middle of the body the window may reach, in body heights."""


@dataclass(frozen=True)
class Whereabouts:
    """Where a person is in the newest frame, and the shift that led there, in working pixels."""

    center: tuple[float, float]
    shift: Shift


class Target:
    """
    A person in one slot.

    What is done with it is elsewhere: ``following`` for each frame, ``finding`` of somebody lost,
    and ``teaching`` by each mask.
    """

    def __init__(self, track_id: int, world: World, start: Start, config: TrackingConfig) -> None:
        """Begin with the first mask, in the world's newest frame."""
        self.track_id = track_id
        self.world = world
        self.config = config
        self._state = TRACKED
        self._confidence = 0.0
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
        # Nothing has been judged yet: the place then counts even without propagation.
        self._first = True
        self._box: Box | None = None
        self.visibility = Visibility()
        self._uncovered = True
        self.memory = LostAndFound(self.person, world.now)
        self.learner = Learner(self.person, world, self.features, self.memory)
        self.guard = Guard()

    @property
    def state(self) -> str:
        """Return whether the person is tracked or lost; nothing is learnt of somebody lost."""
        return self._state

    @property
    def confidence(self) -> float:
        """Return how well (0..1) the person stood out in the newest frame."""
        return self._confidence

    @property
    def uncovered(self) -> bool:
        """Return whether nobody hid more than a little when the person was seen last."""
        return self._uncovered

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
    def appearance(self) -> Appearance:
        """Return what the person looks like."""
        return self.memory.appearance

    @property
    def lost_s(self) -> float:
        """Return for how many seconds the person has been lost."""
        return self.memory.lost_s

    @property
    def accompanied(self) -> bool:
        """Return whether somebody without a slot may be in the way in the newest frame."""
        return self.track_id in self.world.now.company

    def meets(self, other: Target) -> bool:
        """Return whether another person may be in the way of this one, or the other way round."""
        one, two = self.person, other.person
        reach = _REACH * (one.height + two.height)
        return (
            abs(one.center_x - two.center_x) < reach and abs(one.center_y - two.center_y) < reach
        )

    def likeness(self, world: World, start: Start) -> float:
        """Return how alike (0..1) the colours of a first mask in a world's newest frame are."""
        return self.memory.likeness(start, world.now)

    @property
    def window(self) -> Window:
        """Return the rows and columns about the person in the working image."""
        return self.person.window(self.world.shape)

    def carried_mask(self) -> NDArray[np.uint8]:
        """Return the last mask, carried along with the body, in the window about the person."""
        if self._state == LOST:
            return self.memory.silhouette.placed(self.person, self.world.shape)[self.window]
        return self.world.carried(self.person.mask, self.track_id, self.window)

    def carried_part(self) -> NDArray[np.uint8]:
        """Return what of the person can be followed, as the last mask showed it, likewise."""
        return self.world.carried(self.person.part, self.track_id, self.window)

    def carried_template(self, window: Window) -> NDArray[np.uint8] | None:
        """Return the last matched body in a window, carried along likewise; None without one."""
        return carried_template(self.person, self.world, window)

    def judge(self) -> Claim | None:
        """Judge the pixels in a window about the person, None if all of it is outside."""
        person, seen = self.person, self._state == TRACKED
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

    def clear_sight(self, sight: Sight, values: NDArray[np.uint8], window: Window) -> Sight:
        """
        Return the sight of what does not look like the known background.

        :param values: (h, w) uint8 likelihood of the window.
        """
        record = self.world.now
        return sight.before(record.strange(window, self.config.shadow_floor), values)

    def note(self, sight: Sight) -> None:
        """Note how well the person stands out in the newest frame."""
        self._confidence = sight.confidence
        if self._state == TRACKED:
            self._uncovered = sight.share > ALONE

    def miss(self) -> None:
        """Take in that nothing can be seen in the newest frame."""
        self._confidence = 0.0
        if self._state == TRACKED:
            inside = self.person.share_inside(self.world.shape)
            self.visibility.update(0.0, inside)
            if self.visibility.is_lost:
                self.lose()

    def see(self, values: NDArray[np.uint8], sight: Sight, claim: Claim) -> None:
        """
        Take the likely pixels near the mask for what can be seen of the person.

        :param values: (h, w) uint8 likelihood of the window of the claim.
        """
        height = self.person.height
        box = visible_box(values, sight.uncovered, claim.near, claim.window, height)
        self._box = None if box is None else box.scaled(1 / self.world.scale)

    def shift_now(self, dx: float, dy: float) -> None:
        """Correct the place in the newest frame."""
        self.person.shift(dx, dy)
        body = self.world.now.bodies[self.track_id]
        self.world.now.bodies[self.track_id] = (body[0] + dx, body[1] + dy)

    @property
    def whereabouts(self) -> Whereabouts:
        """Return where the person is now, to come back to by :meth:`put_back`."""
        center = (self.person.center_x, self.person.center_y)
        return Whereabouts(center, self.world.now.bodies[self.track_id])

    def put_back(self, then: Whereabouts) -> None:
        """Undo each :meth:`shift_now` since then."""
        self.person.center_x, self.person.center_y = then.center
        self.world.now.bodies[self.track_id] = then.shift

    def lose(self) -> None:
        """Give the person up for lost."""
        self._state = LOST
        self.person.template = None
        self.memory.begin_search()
        if self.guard.in_doubt:
            self.guard.bring_back(self.person, self.memory)
        self.hide()
        self._box = None

    def regain(self, values: NDArray[np.uint8], sight: Sight, claim: Claim) -> None:
        """
        Track somebody lost again, where the expected mask is.

        :param values: (h, w) uint8 likelihood of the window of the claim.
        """
        dx, dy = self.world.since_mask(self.track_id)
        expected = placed(claim.mask, claim.window, self.world.shape)
        self.person.take(shift_whole(expected, round(-dx), round(-dy)), None)
        self.person.learnt_anew = 0
        self._state = TRACKED
        self.guard.found(self.person)
        self.visibility.seen = sight.seen
        self.see(values, sight, claim)

    def doubt(self) -> None:
        """Go back to what was known before, for the body that is followed is somebody else's."""
        self.guard.bring_back(self.person, self.memory)
        self._state, self.person.template = LOST, None

    def hide(self) -> None:
        """Take the next masks for those of somebody seen in part, until they show all."""
        self.learner.hide()
        self.visibility.restart()

    def result(self, likelihood: NDArray[np.uint8]) -> TrackResult:
        """
        Return what is known in the newest frame.

        :param likelihood: (h, w) uint8 of the working image.
        """
        seen = self._state == TRACKED
        source = self.world.source
        return TrackResult(
            self.world.now.image.stamp_ns,
            self.track_id,
            (self.box.clipped(source[1], source[0]) or self.body) if seen else None,
            likelihood,
            self._confidence,
            self.person.angle,
            self._state,
            self.body if seen else None,
            self.features.features if seen else (),
        )

    def skip(self, record: Record) -> None:
        """Let go of a frame that is never learnt: only its motion counts."""
        if self._state == TRACKED:
            self.learner.skip(record)

    def snapshot(self) -> TargetSnapshot:
        """Return what is known now, to come back to by :meth:`restore`."""
        return TargetSnapshot(
            self.person.snapshot(),
            self.memory.snapshot(),
            self._state,
            self._confidence,
        )

    def restore(self, snapshot: TargetSnapshot) -> None:
        """Forget what looking in vain in the newest frame changed since a snapshot was made."""
        self.person.restore(snapshot.person)
        self.memory.restore(snapshot.memory)
        self._state, self._confidence = snapshot.state, snapshot.confidence


@dataclass(frozen=True)
class TargetSnapshot:
    """What was known of a person in a slot at some time."""

    person: PersonSnapshot
    memory: MemorySnapshot
    state: str
    confidence: float
