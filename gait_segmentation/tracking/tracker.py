# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The tracking stage: frames in, boxes and foreground likelihood images of people out."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import count
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import InputError
from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.geometry import Box, check_body, check_start_box
from gait_segmentation.heat_maps import HeatMap, HeatMaps
from gait_segmentation.images import check_image, shrink
from gait_segmentation.results import LOST, TRACKED, Feedback, TrackResult
from gait_segmentation.scene.working import working_scale, working_shape
from gait_segmentation.stamps import check_later, check_stamp
from gait_segmentation.starting import StartingConfig, WalkerFinder
from gait_segmentation.tracking import group
from gait_segmentation.tracking.adaptive_mean_shift import MeanShiftTarget
from gait_segmentation.tracking.arrivals import Arrival, MapFinder, look_at, slot_for_found
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.person import WIDEST
from gait_segmentation.tracking.target import Target
from gait_segmentation.tracking.trial import Trial
from gait_segmentation.tracking.world import World

_SAME_PERSON = 0.4
"""Overlap (intersection over union) from which a box is that of a person already tracked."""


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

        :param bank: the templates that people are found and first masks estimated with.
        :param max_people: number of slots.
        :param starting: how people are found without a box.
        """
        self._config = tracking or TrackingConfig()
        self._bank = bank
        self._ids = count(1)
        self._slots: list[Target | None] = [None] * max_people
        self.starting = starting or StartingConfig()
        self._boxes: list[Box] = []
        self._given = False
        self._heat_maps = HeatMaps()
        self._forget()

    def _forget(self) -> None:
        self._slots = [None] * len(self._slots)
        self._trials: dict[int, Trial] = {}
        self._worlds: list[World] = []
        self._source: tuple[int, int] | None = None
        self._heat_map: HeatMap | None = None
        self._stamp_ns = 0

    @property
    def config(self) -> TrackingConfig:
        """Return the configuration in force; it may be exchanged between frames."""
        return self._config

    @config.setter
    def config(self, config: TrackingConfig) -> None:
        self._config = config
        for target in self.targets():
            target.config = config

    @property
    def starting(self) -> StartingConfig:
        """Return how people are found; another configuration begins the search anew."""
        return self._starting

    @starting.setter
    def starting(self, config: StartingConfig) -> None:
        self._starting = config
        self._finder = WalkerFinder(self._bank, config, len(self._slots))
        self._map_finder = MapFinder(self._bank)

    def reset(self) -> None:
        """Forget everything but the track ids given so far."""
        self.begin_anew()
        self._boxes = []
        self._given = False
        self._heat_maps.clear()

    def begin_anew(self) -> None:
        """Forget everybody and the place, but not what waits for the next frame."""
        self._forget()
        self._finder.reset()
        self._map_finder.reset()

    def initialize(self, box: Box) -> None:
        """
        Start a new track at the next frame.

        A box on a person already tracked starts that slot anew; any other takes a free slot, or
        without one, that of the least confident person.

        :param box: the tight box of a person, in source pixels.
        :raises InputError: if it is no Box.
        """
        if not isinstance(box, Box):
            raise InputError(f'box to start from must be a Box, got {box!r}')
        self._boxes.append(box)

    def add_heat_map(self, heat_map: NDArray[Any], stamp_ns: int) -> None:
        """
        Take in where people are as others see it: evidence beside the tracker's own.

        The newest map counts that is not older than ``heat_map_age``, carried along with people.

        :param heat_map: of any size and kind, see :func:`heat_map_of`.
        :param stamp_ns: that of the frame it was made of, which may still come or be some before.
        :raises InputError: if it is no heat map.
        """
        check_stamp(stamp_ns)
        self._heat_maps.add(heat_map, stamp_ns)

    def update(
        self, image: NDArray[np.uint8], stamp_ns: int, heat_map: NDArray[Any] | None = None
    ) -> list[TrackResult]:
        """
        Take in the next frame.

        Another image size forgets everybody.

        :param image: (H, W, 3) uint8 BGR.
        :param stamp_ns: its stamp, later than the last one's; see :meth:`reset`.
        :param heat_map: that of this frame, see :meth:`add_heat_map`.
        :returns: one result for each slot.
        :raises InputError: if the image is no BGR image, the stamp is not positive or not
            later than the last one, or a box to start from lies outside of the image or is far
            larger (the box is then dropped, the rest is as before).
        """
        check_later(stamp_ns, self._stamp_ns)
        self.check(image)
        source = (image.shape[0], image.shape[1])
        if heat_map is not None:
            self.add_heat_map(heat_map, stamp_ns)
        if self._source is not None and source != self._source:
            self._forget()
        self._source, self._stamp_ns = source, stamp_ns
        self._heat_map = self._heat_maps.newest(stamp_ns, self._config.heat_map_age)
        for world in self._worlds:
            people = self.targets(world)
            group.follow(world, people, image, stamp_ns, self._config, self._heat_map)
        boxes, self._boxes = self._boxes, []
        self._given = self._given or bool(boxes)
        # Before the boxes: what the camera saw until now tells what in them is the person.
        found = self._watch(image)
        started: set[int] = set()
        for box in boxes:
            slot = self._slot_for(box, started)
            started.add(slot)
            self._start(slot, image, box)
        for box, by_walk in found:
            world = self._world_for(image, box)
            arrival = self._look_at(world, box.scaled(world.scale), by_map=not by_walk)
            self._welcome(world, arrival, by_walk=by_walk)
        results = self._judge()
        for world in self._worlds:
            for record in world.drop_old():
                for target in self.targets(world):
                    target.skip(record)
        return results

    def check(self, image: NDArray[np.uint8]) -> None:
        """
        Refuse what :meth:`update` would.

        :raises InputError: if the image is no BGR image or a box to start from does not fit it.
        """
        check_image(image)
        for box in self._boxes:
            try:
                check_start_box(box, (image.shape[1], image.shape[0]))
            except InputError:
                self._boxes.remove(box)
                raise

    def learn(self, feedback: Sequence[Feedback]) -> None:
        """
        Learn from the masks of all people in an earlier frame.

        Feedback for frames no longer kept, or of other tracks, is ignored.

        :raises InputError: if a mask does not have the source's size, a body makes no sense, or
            the frames differ.
        """
        stamps = {each.stamp_ns for each in feedback}
        if len(stamps) > 1:
            raise InputError(f'feedback must be for one frame, got the stamps {sorted(stamps)}')
        known = {target.track_id for target in self.targets()}
        by_track = {each.track_id: each for each in feedback if each.track_id in known}
        for each in by_track.values():
            if each.mask.shape != self._source or each.mask.dtype != np.uint8:
                raise InputError(
                    f'mask must be uint8 of the source size {self._source}, got '
                    f'{each.mask.shape} {each.mask.dtype}'
                )
            if each.body is not None:
                check_body(each.body, (each.mask.shape[1], each.mask.shape[0]))
            if each.track_id in self._trials:
                shape = each.shape_prior.shape
                small = shrink(each.mask, shape)
                self._trials[each.track_id].learn(each.stamp_ns, small, each.shape_prior)
        if by_track:
            for world in self._worlds:
                stamp_ns = feedback[0].stamp_ns
                group.learn(world, self.targets(world), stamp_ns, by_track, self._config)

    def targets(self, world: World | None = None) -> list[Target]:
        """Return who is tracked in a world, or in all, in the order of their slots."""
        found = (target for target in self._slots if target is not None)
        return [target for target in found if world is None or target.world is world]

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
        if None in self._slots:
            return self._slots.index(None)
        confidences = [0.0 if each is None else each.confidence for each in self._slots]
        return min(overlap or range(len(self._slots)), key=lambda slot: confidences[slot])

    def _watch(self, image: NDArray[np.uint8]) -> list[tuple[Box, bool]]:
        """
        Remember what the place looks like; return who is found for free slots, see :meth:`_find`.

        Who was found by the walk is on trial at first, and looked at by the search until then.
        """
        if self._given and any(self._slots):
            return []
        self._end_trials()
        free = any(target is None or target.state == LOST for target in self._slots)
        if not (free or self._trials) and len(self._slots) == 1:
            return []
        occupied: list[Box] = []
        tried: list[Box] = []
        for target in self.targets():
            if target.state == TRACKED:
                (tried if target.track_id in self._trials else occupied).append(target.body)
        wanted = bool(free or self._trials) and not self._given
        heat = self._heat_map
        heat = heat if free and heat is not None and heat.stamp_ns == self._stamp_ns else None
        found = self._find(image, occupied, tried, heat, wanted=wanted)
        return found if free else []

    def _find(
        self,
        image: NDArray[np.uint8],
        occupied: Sequence[Box],
        tried: Sequence[Box],
        heat: HeatMap | None,
        *,
        wanted: bool,
    ) -> list[tuple[Box, bool]]:
        """
        Return the boxes of people newly found, and whether by the walk or in a heat map.

        :param occupied: boxes of people known already, in source pixels.
        :param tried: those of people found by their walk who are still on trial.
        :param heat: where people are as others see it, if of this frame.
        :param wanted: whether there is a slot for anybody; if not, what moves is followed only.
        """
        # No wider than one body: somebody else may be beside it.
        taken, doubtful = (
            [
                Box.from_center(
                    box.center_x, box.center_y, min(box.width, WIDEST * box.height), box.height
                )
                for box in boxes
            ]
            for boxes in (occupied, tried)
        )
        walkers = self._finder.update(image, self._stamp_ns, taken, tried=doubtful, wanted=wanted)
        found = [(box, True) for box in walkers]
        if heat is None or not wanted or self._starting.auto_init == 'none':
            return found
        searched = max(1.0, max(image.shape[:2]) / self._starting.search_size)
        least, known = self._starting.least_height * searched, [*occupied, *tried, *walkers]
        shown = self._map_finder.update(heat, image.shape[:2], known, least)
        return [*found, *((box, False) for box in shown)]

    def _end_trials(self) -> None:
        """Free the slots of those who were found and proved to be nobody."""
        trials, self._trials = self._trials, {}
        for slot, target in enumerate(self._slots):
            trial = None if target is None else trials.get(target.track_id)
            if target is None or trial is None:
                continue
            if target.state == TRACKED:
                trial.see(self._finder.evidence(target.body))
            vanished = target.state == LOST and target.is_inside
            if trial.is_failed(self._stamp_ns, vanished=vanished):
                self._slots[slot] = None
                self._finder.refute(target.body)
            elif not trial.is_over(self._stamp_ns):
                self._trials[target.track_id] = trial
        self._drop_empty_worlds()

    def _welcome(self, world: World, arrival: Arrival, *, by_walk: bool) -> None:
        """Start somebody found in a slot, if there is one."""
        place = slot_for_found(self._slots, world, arrival[0])
        if place is not None:
            slot, track_id = place
            target = self._slots[slot] = self._new_target(world, arrival, track_id)
            if track_id is None and by_walk:
                self._trials[target.track_id] = Trial(self._stamp_ns)
        self._drop_empty_worlds()

    def _new_target(self, world: World, arrival: Arrival, track_id: int | None = None) -> Target:
        number = next(self._ids) if track_id is None else track_id
        start, heat_map = arrival
        if self._config.method == 'adaptive_mean_shift':
            return MeanShiftTarget(number, world, start, self._config)
        return Target(number, world, start, self._config, heat_map=heat_map)

    def _start(self, slot: int, image: NDArray[np.uint8], box: Box) -> None:
        """Start the person in a box that was given."""
        self._slots[slot] = None
        self._drop_empty_worlds()
        world, margin = self._world_for(image, box), self._config.box_margin
        inner = box.padded(-margin * box.width, -margin * box.height).scaled(world.scale)
        self._slots[slot] = self._new_target(world, self._look_at(world, inner))

    def _look_at(self, world: World, box: Box, *, by_map: bool = False) -> Arrival:
        """Estimate a first mask in a box in working pixels."""
        past = self._finder.past(self._stamp_ns)
        return look_at(world, box, past, self._bank, self._config, by_map=by_map)

    def _world_for(self, image: NDArray[np.uint8], box: Box) -> World:
        """Return a world in which a person is well seen, already in the newest frame."""
        for world in self._worlds:
            if world.fits(box.height):
                return world
        assert self._source is not None
        world = World(self._source, box.height, self._config)
        past = self._finder.past(self._stamp_ns)
        if past is not None:
            world.see_as(*past.levels())
        texture, heat = self._config.use_texture, self._heat_map
        world.advance(image, self._stamp_ns, (), camera=False, texture=texture, heat=heat)
        self._worlds.append(world)
        return world

    def _drop_empty_worlds(self) -> None:
        self._worlds = [world for world in self._worlds if self.targets(world)]

    def _judge(self) -> list[TrackResult]:
        """Compute the likelihoods of a frame, refine the boxes by them, and look for the lost."""
        assert self._source is not None
        likelihoods: dict[int, NDArray[np.uint8]] = {}
        for world in self._worlds:
            likelihoods |= group.judge(world, self.targets(world))
        results = []
        for slot, target in enumerate(self._slots):
            if target is None:
                results.append(self.nobody(self._stamp_ns, self._source))
                continue
            likelihood = likelihoods.get(target.track_id)
            if likelihood is None or target.state == LOST:
                likelihood = np.zeros(target.world.shape, np.uint8)
            results.append(target.result(likelihood))
            if target.state == LOST and target.lost_s > self._config.patience:
                self._slots[slot] = None
        return results

    def nobody(self, stamp_ns: int, source: tuple[int, int]) -> TrackResult:
        """Return that nobody is tracked in a frame; ``source`` is (H, W) of the image."""
        scale = working_scale(
            *source,
            working_size=self._config.working_size,
            person_height=1,
            working_height=1,
        )
        shape = working_shape(*source, scale)
        return TrackResult(stamp_ns, 0, None, np.zeros(shape, np.uint8), 0.0)
