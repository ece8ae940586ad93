# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The tracking stage: frames in, boxes and foreground likelihood images of people out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import count
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.colour import NO_CHROMA, NO_GRADIENT
from gait_segmentation.detector.lookout import Lookout
from gait_segmentation.errors import InputError
from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.geometry import Box, check_body, check_start_box
from gait_segmentation.heat_maps import HeatMap, HeatMaps
from gait_segmentation.images import check_image, shrink
from gait_segmentation.results import LOST, TRACKED, Feedback, TrackResult
from gait_segmentation.scene.scene import Scene, SceneOptions, View, Whereabouts, WholeView
from gait_segmentation.scene.working import working_scale, working_shape
from gait_segmentation.stamps import check_later, check_stamp
from gait_segmentation.starting import FirstMask, StartingConfig
from gait_segmentation.starting.starter import (
    BY_DETECTOR,
    BY_MAP,
    BY_WALK,
    Known,
    Proposal,
    Starter,
)
from gait_segmentation.tracking import group
from gait_segmentation.tracking.bystanders import Bystanders
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.fusion import FusionTrack
from gait_segmentation.tracking.initialization import estimate_first, slot_for_found
from gait_segmentation.tracking.life_cycle import ENDED, GAP_S, next_state
from gait_segmentation.tracking.mean_shift import MeanShiftTrack
from gait_segmentation.tracking.pose import WIDEST
from gait_segmentation.tracking.track import SAME_PERSON, Track

_LATEST_NS = 400_000_000
"""Time after which it is no longer known who was where when the detector looked."""

_MOST_APART = 1.5
"""Ratio of the scales of people who share a view."""


class PeopleTracker:
    """
    Tracks people from first boxes, each in a slot of its own, and finds them by their walk.

    People are looked for while a slot is free or waits for a lost person, and until a box is
    given by :meth:`initialize`; then whoever gives boxes is to give all.  Who is near somebody in
    a slot is followed as well where a heat map shows them, but not published.

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
        lookout: Lookout | None = None,
    ) -> None:
        """
        Make a tracker without a track.

        :param bank: the templates that people are found and first masks estimated with.
        :param max_people: number of slots.
        :param starting: how people are found without a box.
        :param lookout: who looks at whole images where that asks for a detector, and makes heat
            maps if it can; if None the detector of the package, in lockstep.
        """
        self._config = tracking or TrackingConfig()
        self._bank = bank
        self.lookout = lookout or Lookout()
        self._ids = count(1)
        self._slots: list[Track | None] = [None] * max_people
        self._starter = self._make_starter(starting or StartingConfig())
        self._boxes: list[Box] = []
        self._given = False
        self._heat_maps = HeatMaps()
        self._forget()

    def _forget(self) -> None:
        self._slots = [None] * len(self._slots)
        self._reasons = [''] * len(self._slots)
        self._bystanders = Bystanders()
        self._scene: Scene | None = None
        self._heat_maps.forget()
        self._stamp_ns = 0
        self._starter.forget()

    def _make_starter(self, config: StartingConfig) -> Starter:
        return Starter(self._bank, config, len(self._slots), self.lookout)

    @property
    def config(self) -> TrackingConfig:
        """Return the configuration in force; it may be exchanged between frames."""
        return self._config

    @config.setter
    def config(self, config: TrackingConfig) -> None:
        self._config = config
        for track in self._followed():
            track.configure(config)

    @property
    def starting(self) -> StartingConfig:
        """Return how people are found; another configuration resets the search."""
        return self._starter.config

    @starting.setter
    def starting(self, config: StartingConfig) -> None:
        # The scene goes on without the view of the search so far.
        self._starter.forget()
        self._starter = self._make_starter(config)

    def reset(self, *, waiting: bool = True) -> None:
        """
        Forget all people and the place, but the track ids given so far.

        :param waiting: whether to forget the boxes and maps that wait for the next frame, too.
        """
        self._forget()
        if waiting:
            self._boxes = []
            self._given = False
            self._heat_maps = HeatMaps()

    def initialize(self, box: Box) -> None:
        """
        Start a new track at the next frame.

        A box on a person already tracked restarts that slot; any other takes a free slot, or
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

        The newest map counts that is not older than ``heat_map_age``, moved along with people.

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

        Another image size resets the tracker.

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
        if self._scene is not None and source != self._scene.source:
            self._forget()
        if self._scene is None or not self._scene.views:
            # No view has followed the place meanwhile.
            self._scene = Scene(source)
        self._stamp_ns = stamp_ns
        sighting = self._starter.look(image, stamp_ns, self._known(stamp_ns))
        if sighting is not None and sighting.heat_map is not None:
            self.add_heat_map(sighting.heat_map, sighting.stamp_ns)
        heat = self._heat_maps.newest(image, stamp_ns, self._config.heat_map_age)
        self._predict(self._scene, image, heat)
        if sighting is not None and stamp_ns - sighting.stamp_ns > _LATEST_NS:
            sighting = None
        if sighting is not None and sighting.people is not None:
            for track in self.tracks():
                there, lost = track.boxes_at(sighting.stamp_ns), track.state == LOST
                track.attendance.add(sighting.people, there, lost=lost)
        boxes, self._boxes = self._boxes, []
        self._given = self._given or bool(boxes)
        # Before the boxes: what the camera saw until now tells what in them is the person.
        at_first = bool(boxes) and not self._scene.views
        known = self._known(stamp_ns if sighting is None else sighting.stamp_ns)
        found = self._starter.propose(self._scene, heat, sighting, known, at_first=at_first)
        started: set[int] = set()
        for box in boxes:
            slot = self._slot_for(box, started)
            started.add(slot)
            self._start(slot, box)
        for each in found:
            self._start_found(each)
        return self._observe(self._scene)

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
        known = {track.track_id: track for track in self.tracks()}
        by_track = {each.track_id: each for each in feedback if each.track_id in known}
        source = None if self._scene is None else self._scene.source
        for each in by_track.values():
            if each.mask.shape != source or each.mask.dtype != np.uint8:
                raise InputError(
                    f'mask must be uint8 of the source size {source}, got '
                    f'{each.mask.shape} {each.mask.dtype}'
                )
            if each.body is not None:
                check_body(each.body, (each.mask.shape[1], each.mask.shape[0]))
            probation = known[each.track_id].probation
            if probation is not None:
                small = shrink(each.mask, each.shape_prior.shape)
                probation.add_mask(each.stamp_ns, small, each.shape_prior)
        if not by_track:
            return
        stamp_ns = feedback[0].stamp_ns
        by_track |= self._bystanders.feedback(stamp_ns)
        for view in self._views():
            group.correct(view, self._followed(view), stamp_ns, by_track, self._config)

    def tracks(self, view: View | None = None) -> list[Track]:
        """Return who is tracked in a view, or in all, in the order of their slots."""
        found = (track for track in self._slots if track is not None)
        return [track for track in found if view is None or track.view is view]

    def _followed(self, view: View | None = None) -> list[Track]:
        """Return everybody who is followed in a view, or in all: bystanders come last."""
        others = self._bystanders.tracks
        return [*self.tracks(view), *(t for t in others if view is None or t.view is view)]

    def _views(self) -> list[View]:
        """Return the views of the scene that people are tracked in."""
        views = () if self._scene is None else self._scene.views
        return [view for view in views if self.tracks(view)]

    def _predict(self, scene: Scene, image: NDArray[np.uint8], heat: HeatMap | None) -> None:
        """
        Take a frame into the scene, and predict all tracks into it.

        After a gap they are lost, to be looked for from where they were: nothing tells how they
        went.
        """
        gap_s = scene.gap_s(self._stamp_ns)
        if gap_s > GAP_S:
            self._update_states(gap_s)
            self._bystanders = Bystanders()
            for track in self.tracks():
                track.stop()
        silhouettes: dict[int, NDArray[np.uint8]] = {}
        people: dict[View, Whereabouts] = {}
        for view in self._views():
            tracks = self._followed(view)
            silhouettes |= group.visible_silhouettes(tracks)
            areas = tuple(track.pose.area for track in tracks)
            people[view] = Whereabouts(areas, any(track.state == LOST for track in tracks))
        config = self._config
        options = SceneOptions(
            config.use_ego_motion,
            config.use_texture,
            config.use_light,
            config.use_flicker,
            config.use_fade,
            config.use_contrast,
        )
        scene.advance(image, self._stamp_ns, people, heat=heat, options=options)
        for track in self._followed():
            if scene.fades:
                track.fade(NO_GRADIENT if track.view.now.image.textured else NO_CHROMA)
            track.predict(silhouettes.get(track.track_id))

    def _slot_for(self, box: Box, started: set[int]) -> int:
        """Return the slot that a box starts: that of the same person, a free one, or any."""
        overlap = {
            slot: track.box.iou(box)
            for slot, track in enumerate(self._slots)
            if track is not None and slot not in started
        }
        best = max(overlap, key=lambda slot: overlap[slot], default=0)
        if overlap and overlap[best] >= SAME_PERSON:
            return best
        if None in self._slots:
            return self._slots.index(None)
        confidences = [0.0 if each is None else each.confidence for each in self._slots]
        return min(overlap or range(len(self._slots)), key=lambda slot: confidences[slot])

    def _known(self, seen_ns: int) -> Known:
        """Return whom the starter need not look for; what can be seen is that of a stamp."""
        tracks = self.tracks()
        tracked = [track for track in tracks if track.state == TRACKED]
        bodies: dict[bool, list[Box]] = {False: [], True: []}
        for track in tracked:
            # No wider than one body: another person may be beside it.
            x, y, height = track.body.center_x, track.body.center_y, track.body.height
            width = min(track.body.width, WIDEST * height)
            bodies[track.probation is not None].append(Box.from_center(x, y, width, height))
        return Known(
            tuple(bodies[False]),
            tuple(bodies[True]),
            tuple(box for track in tracked for box in track.boxes_at(seen_ns)),
            len(tracks) - len(tracked),
            any(track.attendance.silent for track in tracks),
            self._given,
        )

    def _update_states(self, gap_s: float = 0.0) -> None:
        """Let every track go over to its next state, and free the slots of those that end."""
        for slot, track in enumerate(self._slots):
            if track is None:
                continue
            if track.probation is not None and track.state == TRACKED:
                track.probation.see(self._starter.walkers.evidence(track.body))
            state, self._reasons[slot] = next_state(track, self._stamp_ns, gap_s=gap_s)
            if state != ENDED:
                track.enter(state, self._reasons[slot])
                continue
            self._slots[slot] = None
            if track.probation is not None:
                self._starter.walkers.reject(track.body)
        self._drop_unused()

    def _start_found(self, found: Proposal) -> None:
        """Start a person found in a slot, if there is one."""
        view = self._view_for(found.box)
        tight = self._inner(found.box) if found.source == BY_DETECTOR else found.box
        start = self._estimate(view, tight.scaled(view.scale), by_map=found.source == BY_MAP)
        place = slot_for_found(self._slots, view, start)
        # Who gives boxes gives all: others are only found again.
        if place is not None and not (self._given and place[1] is None):
            slot, track_id = place
            track = self._slots[slot] = self._new_track(view, start, track_id)
            if track_id is None and found.source == BY_WALK:
                track.try_out(self._stamp_ns)
        self._drop_unused()

    def _start(self, slot: int, box: Box) -> None:
        """Start the person in a box that was given."""
        self._slots[slot] = None
        self._drop_unused()
        view = self._view_for(box)
        inner = self._inner(box).scaled(view.scale)
        self._slots[slot] = self._new_track(view, self._estimate(view, inner))

    def _inner(self, box: Box) -> Box:
        """Return a box without the margin that those have which others draw."""
        margin = self._config.box_margin
        return box.padded(-margin * box.width, -margin * box.height)

    def _new_track(self, view: View, start: FirstMask, track_id: int | None = None) -> Track:
        number = next(self._ids) if track_id is None else track_id
        self._bystanders.drop(view, start.box)
        if self._config.method == 'adaptive_mean_shift':
            return MeanShiftTrack(number, view, start, self._config)
        return FusionTrack(number, view, start, self._config)

    def _estimate(self, view: View, box: Box, *, by_map: bool = False) -> FirstMask:
        """Estimate a first mask in a box in working pixels."""
        past = self._starter.background
        return estimate_first(view, box, past, self._bank, self._config, by_map=by_map)

    def _view_for(self, box: Box) -> View:
        """Return a view of the scene in which a person is well seen."""
        assert self._scene is not None
        scale = self._scale_for(self._scene.source, box.height)
        for view in self._views():
            if 1 / _MOST_APART <= view.scale / scale <= _MOST_APART:
                return view
        view = View(self._scene.source, scale)
        self._scene.add(view)
        return view

    def _scale_for(self, source: tuple[int, int], height: float) -> float:
        """Return the scale at which a person of a height in source pixels is tracked."""
        size, working = self._config.working_size, self._config.working_height
        return working_scale(
            *source, working_size=size, person_height=height, working_height=working
        )

    def _drop_unused(self) -> None:
        if self._scene is not None:
            used = self._views()
            views = self._scene.views
            self._scene.views = [v for v in views if v in used or isinstance(v, WholeView)]

    def _observe(self, scene: Scene) -> list[TrackResult]:
        """Compute the likelihoods of a frame, refine the boxes by them, and look for the lost."""
        likelihoods: dict[int, NDArray[np.uint8]] = {}
        for view in self._views():
            likelihoods |= group.observe(view, self._followed(view))
        self._update_states()
        self._bystanders.update(self._views(), self.tracks(), likelihoods, self._config)
        results = []
        for slot, track in enumerate(self._slots):
            if track is None:
                empty = self.empty(self._stamp_ns, scene.source)
                results.append(replace(empty, reason=self._reasons[slot]))
                continue
            likelihood = likelihoods.get(track.track_id)
            if likelihood is None or track.state == LOST:
                likelihood = np.zeros(track.view.shape, np.uint8)
            results.append(track.result(likelihood))
        return results

    def empty(self, stamp_ns: int, source: tuple[int, int]) -> TrackResult:
        """Return the result of an empty slot; ``source`` is (H, W) of the image."""
        scale = self._scale_for(source, self._config.working_height)
        shape = working_shape(*source, scale)
        return TrackResult(stamp_ns, 0, None, np.zeros(shape, np.uint8), 0.0)
