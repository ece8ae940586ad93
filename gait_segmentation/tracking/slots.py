# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Everybody who is followed: one person a slot, and bystanders, who have none."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import count

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.detector.lookout import Sighting
from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.geometry import Box
from gait_segmentation.results import LOST, TRACKED, TrackResult
from gait_segmentation.scene.scene import Scene, View, WholeView
from gait_segmentation.scene.working import working_scale
from gait_segmentation.starting import FirstMask
from gait_segmentation.starting.starter import (
    BY_DETECTOR,
    BY_MAP,
    BY_WALK,
    Known,
    Proposal,
    Starter,
)
from gait_segmentation.tracking.bystanders import Bystanders, is_near
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.cues.sighting import recognize
from gait_segmentation.tracking.fusion import FusionTrack
from gait_segmentation.tracking.initialization import estimate_first, slot_for_found
from gait_segmentation.tracking.life_cycle import ENDED, next_state
from gait_segmentation.tracking.mean_shift import MeanShiftTrack, start_in
from gait_segmentation.tracking.pose import WIDEST_BODY
from gait_segmentation.tracking.track import SAME_PERSON, Track

_METHODS: dict[str, tuple[Callable[..., FirstMask], type[FusionTrack] | type[MeanShiftTrack]]] = {
    'fusion': (estimate_first, FusionTrack),
    'adaptive_mean_shift': (start_in, MeanShiftTrack),
}
"""How a track begins, and its class, by ``tracking.method``."""

_MOST_APART = 1.5
"""Ratio of the scales of people who share a view."""


class Slots:
    """
    Tracks by slot, and of bystanders: who begins in which, and who leaves.

    ``reasons`` say by slot why the track is lost, or the last one of an empty slot has ended.
    """

    def __init__(self, bank: TemplateBank, config: TrackingConfig, slots: int) -> None:
        """
        Begin without anybody.

        :param bank: the templates that first masks are estimated with.
        :param slots: how many there are.
        """
        self.config = config
        self._bank, self._count, self._ids = bank, slots, count(1)
        self.clear()

    def clear(self) -> None:
        """Let go of all people, but not of the track ids given so far."""
        self._slots: list[Track | None] = [None] * self._count
        self.reasons = [''] * self._count
        self.bystanders = Bystanders()

    def configure(self, config: TrackingConfig) -> None:
        """Go on with another configuration."""
        self.config = config
        for track in self.followed():
            track.configure(config)

    def tracks(self, view: View | None = None) -> list[Track]:
        """Return who is tracked in a view, or in all, in the order of their slots."""
        found = (track for track in self._slots if track is not None)
        return [track for track in found if view is None or track.view is view]

    def followed(self, view: View | None = None) -> list[Track]:
        """Return everybody who is followed in a view, or in all: bystanders come last."""
        others = self.bystanders.tracks
        return [*self.tracks(view), *(t for t in others if view is None or t.view is view)]

    def views(self, scene: Scene) -> list[View]:
        """Return the views of a scene that people in slots are tracked in."""
        return [view for view in scene.views if self.tracks(view)]

    def known(self, seen_ns: int, *, given: bool) -> Known:
        """
        Return whom a starter need not look for.

        :param seen_ns: stamp of the frame of which it is told what can be seen.
        :param given: whether whoever gives boxes is to give all.
        """
        tracks = self.tracks()
        tracked = [track for track in tracks if track.state == TRACKED]
        bodies: dict[bool, list[Box]] = {False: [], True: []}
        for track in tracked:
            # No wider than one body: another person may be beside it.
            x, y, height = track.body.center_x, track.body.center_y, track.body.height
            width = min(track.body.width, WIDEST_BODY * height)
            bodies[track.probation is not None].append(Box.from_center(x, y, width, height))
        return Known(
            tuple(bodies[False]),
            tuple(bodies[True]),
            tuple(box for track in tracked for box in track.boxes_at(seen_ns)),
            tuple(track.body for track in tracks if track.state == LOST),
            any(track.attendance.silent for track in tracks),
            given,
        )

    def witness(self, sighting: Sighting) -> None:
        """Take in whom a detector saw, if it was asked for people."""
        if sighting.people is None:
            return
        stamp_ns, boxes = sighting.stamp_ns, [person.box for person in sighting.people]
        followed = self.followed()
        for track in followed:
            there, lost = track.boxes_at(stamp_ns), track.state == LOST
            track.attendance.add(sighting.people, there, lost=lost)
        tracked = [track for track in followed if track.state == TRACKED]
        sought = [track.sought_in(stamp_ns) for track in tracked]
        for number, seen in recognize(sought, boxes):
            person = sighting.people[seen]
            tracked[number].stillness.vouch(person.score)
            tracked[number].see_box(person.box, stamp_ns)

    def begin_given(self, scene: Scene, boxes: Sequence[Box], past: WholeView | None) -> None:
        """
        Begin with the people in boxes that were given.

        A box on a person who is tracked begins that slot anew; any other takes a free slot, or
        without one, that of the least confident person.

        :param boxes: in source pixels, in the newest frame of the scene.
        :param past: the place as it was before, if it is known.
        """
        begun: set[int] = set()
        for box in boxes:
            slot = self._slot_for(box, begun)
            begun.add(slot)
            self._slots[slot] = None
            self._drop_unused(scene)
            view = self._view_for(scene, box)
            start = self._estimate(view, self._inner(box).scaled(view.scale), past)
            self._slots[slot] = self._new_track(view, start)

    def begin_found(
        self, scene: Scene, found: Sequence[Proposal], past: WholeView | None, *, given: bool
    ) -> None:
        """
        Begin with people who were found, as far as there are slots, then with bystanders.

        :param past: the place as it was before, if it is known.
        :param given: whether whoever gives boxes is to give all; then only the lost begin again.
        """
        for each in found:
            lost = any(track.state == LOST for track in self.tracks())
            if not (lost or (None in self._slots and not given)):
                self._begin_beside(each, past)
                continue
            view = self._view_for(scene, each.box)
            tight = self._tight(each).scaled(view.scale)
            start = self._estimate(view, tight, past, by_map=each.source == BY_MAP)
            place = slot_for_found(self._slots, view, start)
            if place is not None and not (given and place[1] is None):
                slot, track_id = place
                before = self._slots[slot]
                track = self._slots[slot] = self._new_track(view, start, track_id)
                if before is not None and track_id is not None:
                    track.succeed(before)
                if each.source != BY_WALK:
                    track.expect_motion()
                elif track_id is None:
                    track.try_out(scene.stamp_ns)
            self._drop_unused(scene)

    def _begin_beside(self, found: Proposal, past: WholeView | None) -> None:
        """Begin with a bystander, if somebody in a slot is near."""
        if self.bystanders.is_full or not self.config.use_bystanders:
            return
        by_map = found.source == BY_MAP
        for track in self.tracks():
            box = self._tight(found).scaled(track.view.scale)
            if is_near(box, track) and not self.bystanders.at(track.view, box):
                start = self._estimate(track.view, box, past, by_map=by_map)
                self.bystanders.begin(track.view, start, self.config, by_map=by_map)
                return

    def go_over(self, scene: Scene, stamp_ns: int, starter: Starter, gap_s: float = 0.0) -> None:
        """
        Let every track go over to its next state, and free the slots of those that end.

        :param starter: what tells of the walk of those on trial, and is told who was nobody.
        :param gap_s: see :func:`.next_state`.
        """
        for slot, track in enumerate(self._slots):
            if track is None:
                continue
            if track.probation is not None and track.state == TRACKED:
                track.probation.see(starter.walkers.evidence(track.body))
            state, self.reasons[slot] = next_state(track, stamp_ns, gap_s=gap_s)
            if state != ENDED:
                track.enter(state, self.reasons[slot])
                continue
            self._slots[slot] = None
            if track.probation is not None:
                starter.walkers.reject(track.body)
            if track.stillness.is_thing:
                starter.reject(track.body, stamp_ns)
        self._drop_unused(scene)

    def results(
        self, likelihoods: Mapping[int, NDArray[np.uint8]], empty: TrackResult
    ) -> list[TrackResult]:
        """
        Return the result of each slot.

        :param likelihoods: (h, w) uint8 by track id.
        :param empty: that of an empty one.
        """
        results = []
        for track, reason in zip(self._slots, self.reasons, strict=True):
            if track is None:
                results.append(replace(empty, reason=reason))
                continue
            likelihood = likelihoods.get(track.track_id)
            if likelihood is None or track.state == LOST:
                likelihood = np.zeros(track.view.shape, np.uint8)
            results.append(track.result(likelihood))
        return results

    def scale_for(self, source: tuple[int, int], height: float) -> float:
        """Return the scale at which a person of a height in source pixels is tracked."""
        size, working = self.config.working_size, self.config.working_height
        return working_scale(
            *source, working_size=size, person_height=height, working_height=working
        )

    def _slot_for(self, box: Box, begun: set[int]) -> int:
        """Return the slot that a box begins: that of the same person, a free one, or any."""
        overlap = {
            slot: track.box.iou(box)
            for slot, track in enumerate(self._slots)
            if track is not None and slot not in begun
        }
        best = max(overlap, key=lambda slot: overlap[slot], default=0)
        if overlap and overlap[best] >= SAME_PERSON:
            return best
        if None in self._slots:
            return self._slots.index(None)
        confidences = [0.0 if each is None else each.confidence for each in self._slots]
        return min(overlap or range(len(self._slots)), key=lambda slot: confidences[slot])

    def _inner(self, box: Box) -> Box:
        """Return a box without the margin that those have which others draw."""
        margin = self.config.box_margin
        return box.padded(-margin * box.width, -margin * box.height)

    def _tight(self, found: Proposal) -> Box:
        """Return the box of somebody found; a detector leaves a margin."""
        return self._inner(found.box) if found.source == BY_DETECTOR else found.box

    def _estimate(
        self, view: View, box: Box, past: WholeView | None, *, by_map: bool = False
    ) -> FirstMask:
        """Estimate a first mask in a box in working pixels."""
        first = _METHODS[self.config.method][0]
        return first(view, box, past, self._bank, self.config, by_map=by_map)

    def _new_track(self, view: View, start: FirstMask, track_id: int | None = None) -> Track:
        number = next(self._ids) if track_id is None else track_id
        self.bystanders.drop(view, start.box)
        return _METHODS[self.config.method][1](number, view, start, self.config)

    def _view_for(self, scene: Scene, box: Box) -> View:
        """Return a view of the scene in which a person is well seen."""
        scale = self.scale_for(scene.source, box.height)
        for view in self.views(scene):
            if 1 / _MOST_APART <= view.scale / scale <= _MOST_APART:
                return view
        view = View(scene.source, scale)
        scene.add(view)
        return view

    def _drop_unused(self, scene: Scene) -> None:
        scene.keep(self.views(scene))
