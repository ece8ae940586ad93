# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The tracking stage: frames in, boxes and foreground likelihood images of people out."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import count

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import InputError
from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.geometry import Box, body_window, check_start_box
from gait_segmentation.images import check_image, check_stamp
from gait_segmentation.results import LOST, TRACKED, Feedback, TrackResult
from gait_segmentation.starting import Start, StartingConfig, estimate_start
from gait_segmentation.starting.motion_memory import Recollection
from gait_segmentation.tracking.competition import Claim, compete
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.likelihood import likelihood_image
from gait_segmentation.tracking.lost_and_found import SAME_COLOURS
from gait_segmentation.tracking.target import Target
from gait_segmentation.tracking.working import working_scale, working_shape
from gait_segmentation.tracking.world import World

__all__ = ['PeopleTracker']

_SAME_PERSON = 0.4
"""Overlap (intersection over union) from which a box is that of a person already tracked."""

_ABOUT = 0.3
"""How far about somebody found the place is remembered, in body heights."""

_ANOTHER_BOX = 0.07
"""Distance of head and feet of the first mask from those of the box, in heights of the box, from
which somebody found is looked at once more, in the box of the mask."""


class PeopleTracker:
    """
    Tracks people from first boxes, each in a slot of its own, and finds them by their walk.

    People are looked for while a slot is free or waits for somebody lost, and until a box is
    given by :meth:`initialize`; then whoever gives boxes is to give all.

    The likelihood learns from the masks that come back through :meth:`learn`; they may come some
    frames late.
    """

    def __init__(
        self,
        bank: TemplateBank,
        tracking: TrackingConfig | None = None,
        *,
        max_people: int = 1,
        starting: StartingConfig | None = None,
    ) -> None:
        """
        Make a tracker that tracks nobody.

        :param bank: the templates that the first mask of a person is estimated with.
        :param max_people: number of slots.
        :param starting: how people are found without a box.
        """
        self._config = tracking or TrackingConfig()
        self._bank = bank
        self.starting = starting or StartingConfig()
        self._ids = count(1)
        self._slots: list[Target | None] = [None] * max_people
        self._boxes: list[Box] = []
        self._given = False
        self._forget()

    def _forget(self) -> None:
        self._slots = [None] * len(self._slots)
        self._worlds: list[World] = []
        self._source: tuple[int, int] | None = None
        self._heat_map: NDArray[np.uint8] | None = None
        self._stamp_ns = 0

    @property
    def config(self) -> TrackingConfig:
        """Return the configuration in force; it may be exchanged between frames."""
        return self._config

    @config.setter
    def config(self, config: TrackingConfig) -> None:
        self._config = config
        for target in self._targets():
            target.config = config

    @property
    def starting(self) -> StartingConfig:
        """Return how people are found; it may be exchanged between frames."""
        return self._starting

    @starting.setter
    def starting(self, config: StartingConfig) -> None:
        # Here, because the finder uses parts of this package.
        from gait_segmentation.starting import WalkerFinder

        self._starting = config
        self._finder = WalkerFinder(self._bank, config) if config.auto_init != 'off' else None

    def reset(self) -> None:
        """Forget everything but the track ids given so far."""
        self._forget()
        self._boxes = []
        self._given = False
        if self._finder is not None:
            self._finder.reset()

    def initialize(self, box: Box) -> None:
        """
        Start a new track at the next frame.

        A box on a person already tracked starts that slot anew; any other takes a free slot, or
        without one, that of the least confident person.

        :param box: the tight box of a person, in source pixels.
        """
        self._boxes.append(box)

    def update(
        self, image: NDArray[np.uint8], stamp_ns: int, heat_map: NDArray[np.uint8] | None = None
    ) -> list[TrackResult]:
        """
        Take in the next frame.

        A stamp that goes backwards or another image size forgets everybody.

        :param image: (H, W, 3) uint8 BGR.
        :param heat_map: where people are as others see it, (h, w) uint8 of any size, 255 = surely
            a person: one more feature in the pool.
        :returns: one result for each slot.
        :raises InputError: if the image is no BGR image, the stamp is not positive or equal to
            the last one, or a box to start from lies outside of the image or is far larger (the
            box is then dropped, the rest is as before).
        """
        check_image(image)
        check_stamp(stamp_ns)
        if heat_map is not None and (heat_map.ndim != 2 or heat_map.dtype != np.uint8):
            raise InputError(
                f'heat map must be (height, width) uint8, got {heat_map.shape} {heat_map.dtype}'
            )
        if stamp_ns == self._stamp_ns:
            raise InputError(f'stamps must increase, got {stamp_ns} twice')
        source = (image.shape[0], image.shape[1])
        for box in self._boxes:
            try:
                check_start_box(box, (source[1], source[0]))
            except InputError:
                self._boxes.remove(box)
                raise
        if stamp_ns < self._stamp_ns or (self._source is not None and source != self._source):
            self._forget()
        self._source, self._stamp_ns = source, stamp_ns
        self._heat_map = heat_map
        for world in self._worlds:
            self._advance(world, image)
        boxes, self._boxes = self._boxes, []
        self._given = self._given or bool(boxes)
        started: set[int] = set()
        for box in boxes:
            slot = self._slot_for(box, started)
            started.add(slot)
            self._start(slot, image, box)
        self._find(image)
        results = self._judge()
        for world in self._worlds:
            for record in world.drop_old():
                for target in self._targets(world):
                    target.skip(record)
        return results

    def learn(self, feedback: Sequence[Feedback]) -> None:
        """
        Learn from the masks of all people in an earlier frame.

        Feedback for frames no longer kept, or of other tracks, is ignored.

        :raises InputError: if a mask does not have the source's size or the frames differ.
        """
        stamps = {each.stamp_ns for each in feedback}
        if len(stamps) > 1:
            raise InputError(f'feedback must be for one frame, got the stamps {sorted(stamps)}')
        known = {target.track_id for target in self._targets()}
        by_track = {each.track_id: each for each in feedback if each.track_id in known}
        for each in by_track.values():
            if each.mask.shape != self._source or each.mask.dtype != np.uint8:
                raise InputError(
                    f'mask must be uint8 of the source size {self._source}, got '
                    f'{each.mask.shape} {each.mask.dtype}'
                )
        if by_track:
            for world in self._worlds:
                self._learn(world, feedback[0].stamp_ns, by_track)

    def _targets(self, world: World | None = None) -> list[Target]:
        """Return the people of a world, or all."""
        found = (target for target in self._slots if target is not None)
        return [target for target in found if world is None or target.world is world]

    def _advance(self, world: World, image: NDArray[np.uint8]) -> None:
        """Take a frame into a world and follow its people."""
        targets = self._targets(world)
        bodies = [target.carried_mask() for target in targets]
        covers = [
            self._cover(target, list(zip(targets, bodies, strict=True))) for target in targets
        ]
        motion = world.advance(
            image,
            self._stamp_ns,
            [target.person.area for target in targets],
            camera=self._config.use_ego_motion,
            tone=self._config.use_tone,
            everywhere=any(target.state == LOST for target in targets),
            heat=self._heat_map,
        )
        for target, body, cover in zip(targets, bodies, covers, strict=True):
            target.move(motion, body, cover)

    @staticmethod
    def _cover(
        target: Target, masks: Sequence[tuple[Target, NDArray[np.uint8]]]
    ) -> NDArray[np.uint8] | None:
        """Return where a person is hidden by those who stand nearer, None if nowhere."""
        nearer = [
            mask
            for other, mask in masks
            if other.state == TRACKED and other.feet > target.feet and other.meets(target)
        ]
        if not nearer:
            return None
        cover = nearer[0]
        for mask in nearer[1:]:
            cover = cv2.bitwise_or(cover, mask)
        return cover

    def _slot_for(self, box: Box, started: set[int]) -> int:
        """Return the slot that a box starts: that of the same person, a free one, or any."""
        overlap = {
            slot: target.box.iou(box)
            for slot, target in enumerate(self._slots)
            if target is not None and slot not in started
        }
        best = max(overlap, key=lambda slot: overlap[slot], default=0)
        if overlap and overlap[best] >= _SAME_PERSON:
            return best
        free = [slot for slot, target in enumerate(self._slots) if target is None]
        if free:
            return free[0]
        return min(overlap or range(len(self._slots)), key=self._confidence)

    def _confidence(self, slot: int) -> float:
        target = self._slots[slot]
        return 0.0 if target is None else target.confidence

    def _find(self, image: NDArray[np.uint8]) -> None:
        """Give slots to people who are found by their walk."""
        if self._finder is None or self._given:
            return
        if not any(target is None or target.state == LOST for target in self._slots):
            return
        occupied = [target.body for target in self._targets() if target.state == TRACKED]
        for box in self._finder.update(image, self._stamp_ns, occupied):
            self._welcome(image, box)

    def _welcome(self, image: NDArray[np.uint8], box: Box) -> None:
        """Start somebody found: again, if it is one who was lost, else in a free slot."""
        world, start = self._look_at_found(image, box)
        lost = {
            slot: target
            for slot, target in enumerate(self._slots)
            if target is not None and target.state == LOST
        }
        alike = {slot: target.likeness(world, start) for slot, target in lost.items()}
        best = max(alike, key=lambda slot: alike[slot], default=None)
        if best is not None and alike[best] >= SAME_COLOURS:
            self._slots[best] = Target(lost[best].track_id, world, start, self._config)
        elif None in self._slots:
            self._slots[self._slots.index(None)] = self._new_target(world, start)
        elif lost:
            longest = max(lost, key=lambda slot: lost[slot].lost_s)
            self._slots[longest] = self._new_target(world, start)
        self._drop_empty_worlds()

    def _new_target(self, world: World, start: Start) -> Target:
        return Target(next(self._ids), world, start, self._config)

    def _start(self, slot: int, image: NDArray[np.uint8], box: Box) -> None:
        self._slots[slot] = None
        self._drop_empty_worlds()
        self._slots[slot] = self._new_target(*self._first_look(image, box))

    def _first_look(self, image: NDArray[np.uint8], box: Box) -> tuple[World, Start]:
        """Estimate the first mask of a person in a box that was given."""
        world = self._world_for(image, box)
        margin = self._config.box_margin
        inner = box.padded(-margin * box.width, -margin * box.height)
        start = self._estimate(world, inner.scaled(world.scale))
        world.clear(start.mask)
        return world, start

    def _look_at_found(self, image: NDArray[np.uint8], box: Box) -> tuple[World, Start]:
        """Estimate the first mask of somebody found, whose box may be somewhat wrong."""
        world = self._world_for(image, box)
        box = box.scaled(world.scale)
        past = self._past(world, box)
        if past is None:
            start = self._estimate(world, box)
            world.clear(start.mask)
            return world, start
        lab = world.now.image.lab_about(past.window)[past.window]
        evidence = np.zeros(world.shape, np.float32)
        evidence[past.window] = past.evidence(lab, self._config.shadow_floor)
        start = self._estimate(world, box, evidence)
        tight = Box.around(start.mask)
        if tight is not None:
            off = abs(tight.y - box.y), abs(tight.bottom - box.bottom)
            if max(off) > _ANOTHER_BOX * box.height:
                start = self._estimate(world, tight, evidence)
        world.clear(start.mask)
        world.recall(past)
        return world, start

    def _past(self, world: World, box: Box) -> Recollection | None:
        """Return what the place about a box in working pixels looked like before."""
        if self._finder is None:
            return None
        area = body_window(box.center_x, box.center_y, box.height, box)
        area = area.padded(_ABOUT * box.height, _ABOUT * box.height)
        window = area.slices(world.shape[1], world.shape[0])
        return self._finder.recall(self._stamp_ns, world.now.image.bgr, window)

    def _estimate(
        self, world: World, box: Box, evidence: NDArray[np.float32] | None = None
    ) -> Start:
        config = self._config
        return estimate_start(
            world.now.image.lab,
            box,
            self._bank,
            height=config.start_height,
            rounds=config.start_rounds,
            left_out=config.start_left_out,
            use_tilt=config.use_tilt,
            evidence=evidence,
        )

    def _world_for(self, image: NDArray[np.uint8], box: Box) -> World:
        """Return a world in which a person is well seen, already in the newest frame."""
        for world in self._worlds:
            if world.fits(box.height):
                return world
        assert self._source is not None
        world = World.for_person(self._source, box.height, self._config)
        world.advance(image, self._stamp_ns, (), camera=False, heat=self._heat_map)
        self._worlds.append(world)
        return world

    def _drop_empty_worlds(self) -> None:
        self._worlds = [world for world in self._worlds if self._targets(world)]

    def _judge(self) -> list[TrackResult]:
        """Compute the likelihoods of a frame, refine the boxes by them, and look for the lost."""
        likelihoods: dict[int, NDArray[np.uint8]] = {}
        for world in self._worlds:
            self._judge_world(world, likelihoods)
        results = []
        for slot, target in enumerate(self._slots):
            if target is None:
                results.append(self._empty())
                continue
            likelihood = likelihoods.get(target.track_id)
            if likelihood is None or target.state == LOST:
                likelihood = np.zeros(target.world.shape, np.uint8)
            results.append(target.result(likelihood))
            if target.state == LOST and target.lost_s > self._config.patience:
                self._slots[slot] = None
        return results

    def _judge_world(self, world: World, likelihoods: dict[int, NDArray[np.uint8]]) -> None:
        """Let people compete for pixels, assess each by what it got, and look for the lost."""
        judged = [(target, target.judge()) for target in self._targets(world)]
        present = [(target, claim) for target, claim in judged if claim is not None]
        masks = [(target, claim.mask) for target, claim in present]
        logits = compete([claim for _, claim in present])
        for target, nothing in judged:
            if nothing is None and target.state == TRACKED:
                target.lose()
        for (target, claim), logit in zip(present, logits, strict=True):
            likelihood = likelihood_image(logit, claim.window, world.shape)
            likelihoods[target.track_id] = likelihood
            if target.state == TRACKED:
                target.assess(likelihood, claim.window, claim.mask, self._cover(target, masks))
        lost = [t for t in self._targets(world) if t.state == LOST and t.lost_s > 0]
        if lost:
            self._recover(world, lost, {t.track_id: claim for t, claim in present}, likelihoods)

    def _recover(
        self,
        world: World,
        lost: list[Target],
        claims: dict[int, Claim],
        likelihoods: dict[int, NDArray[np.uint8]],
    ) -> None:
        """Look for those who are lost, where nobody else is."""
        taken = np.zeros(world.shape, np.uint8)
        for target in self._targets(world):
            if target.state == TRACKED:
                likely = likelihoods[target.track_id] > 127
                taken |= np.where(likely, target.carried_mask(), 0)
        for target in lost:
            found = target.recover(
                claims.get(target.track_id), likelihoods.get(target.track_id), taken
            )
            if found is not None:
                likelihoods[target.track_id] = found
                taken |= np.where(found > 127, target.carried_mask(), 0)

    def _empty(self) -> TrackResult:
        assert self._source is not None
        scale = working_scale(
            *self._source,
            working_size=self._config.working_size,
            person_height=1,
            working_height=1,
        )
        shape = working_shape(*self._source, scale)
        return TrackResult(self._stamp_ns, 0, None, np.zeros(shape, np.uint8), 0.0)

    def _learn(self, world: World, stamp_ns: int, by_track: dict[int, Feedback]) -> None:
        """Learn a frame in one world: people first, then what surrounds all of them."""
        targets = self._targets(world)
        skipped, record = world.take(stamp_ns)
        for each in skipped:
            for target in targets:
                target.skip(each)
        if record is None:
            return
        people = np.zeros(world.shape, np.uint8)
        around = []
        for target in targets:
            if target.track_id not in record.bodies:
                continue
            feedback = by_track.get(target.track_id)
            alone = not any(target.meets(other) for other in targets if other is not target)
            learnt = None if feedback is None else target.learn(record, feedback, alone=alone)
            if learnt is None:
                target.skip(record)
                people[target.person.area.slices(world.shape[1], world.shape[0])] = 255
            else:
                people |= learnt[0]
                around.append(learnt[1])
        if self._config.use_background and around:
            gate = self._config.use_motion_gate
            world.learn(record, people, around, gate=gate)
