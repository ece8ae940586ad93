# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The tracking stage: frames in, boxes and foreground likelihood images of people out."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.colour import NO_CHROMA, NO_GRADIENT
from gait_segmentation.detector.lookout import Lookout, Sighting
from gait_segmentation.errors import InputError
from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.geometry import Box, check_start_box
from gait_segmentation.heat_maps import HeatMap, HeatMaps
from gait_segmentation.images import check_image, shrink
from gait_segmentation.results import LOST, Feedback, TrackResult
from gait_segmentation.scene.scene import Scene, View, Whereabouts
from gait_segmentation.scene.working import working_shape
from gait_segmentation.stamps import check_later, check_stamp
from gait_segmentation.starting import StartingConfig
from gait_segmentation.starting.starter import Starter
from gait_segmentation.tracking import group
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.life_cycle import GAP_S
from gait_segmentation.tracking.slots import Slots
from gait_segmentation.tracking.track import Track

_LATEST_NS = 400_000_000
"""Time after which it is no longer known who was where when the detector looked."""


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
        self.lookout = lookout or Lookout()
        self._make_starter = partial(Starter, bank, slots=max_people, lookout=self.lookout)
        self._starter = self._make_starter(starting or StartingConfig())
        self._slots = Slots(bank, tracking or TrackingConfig(), max_people)
        self.reset()

    @property
    def config(self) -> TrackingConfig:
        """Return the configuration in force; it may be exchanged between frames."""
        return self._slots.config

    @config.setter
    def config(self, config: TrackingConfig) -> None:
        self._slots.configure(config)

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
        self._slots.clear()
        self._starter.forget()
        self._scene: Scene | None = None
        self._stamp_ns = 0
        if waiting:
            self._boxes: list[Box] = []
            self._given = False
            self._heat_maps = HeatMaps()
        self._heat_maps.forget()

    def initialize(self, box: Box) -> None:
        """
        Start a new track at the next frame.

        In which slot is told by :meth:`.Slots.begin_given`.

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
        if heat_map is not None:
            self.add_heat_map(heat_map, stamp_ns)
        scene, self._stamp_ns = self._scene_of((image.shape[0], image.shape[1])), stamp_ns
        boxes, self._boxes = self._boxes, []
        self._given = self._given or bool(boxes)
        sighting = self._look(image, stamp_ns)
        heat = self._heat_maps.newest(image, stamp_ns, self.config.heat_map_age)
        self._predict(scene, image, heat)
        if sighting is not None:
            self._slots.witness(sighting)
        # Before the boxes: what the camera saw until now tells what in them is the person.
        at_first = bool(boxes) and not scene.views
        seen_ns = stamp_ns if sighting is None else sighting.stamp_ns
        known = self._slots.known(seen_ns, given=self._given)
        found = self._starter.propose(scene, heat, sighting, known, at_first=at_first)
        self._slots.begin_given(scene, boxes, self._starter.background)
        self._slots.begin_found(scene, found, self._starter.background, given=self._given)
        return self._observe(scene)

    def _scene_of(self, source: tuple[int, int]) -> Scene:
        """Return the scene of images of a size, a new one if no view has followed the place."""
        if self._scene is not None and source != self._scene.source:
            self.reset(waiting=False)
        if self._scene is None or not self._scene.views:
            self._scene = Scene(source)
        return self._scene

    def _look(self, image: NDArray[np.uint8], stamp_ns: int) -> Sighting | None:
        """Let the detector look, take in its heat map, and return what it saw of late."""
        known = self._slots.known(stamp_ns, given=self._given)
        sighting = self._starter.look(image, stamp_ns, known)
        if sighting is None:
            return None
        if sighting.heat_map is not None:
            self.add_heat_map(sighting.heat_map, sighting.stamp_ns)
        return sighting if stamp_ns - sighting.stamp_ns <= _LATEST_NS else None

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
            each.check(source)
            probation = known[each.track_id].probation
            if probation is not None:
                small = shrink(each.mask, each.shape_prior.shape)
                probation.add_mask(each.stamp_ns, small, each.shape_prior)
        if not by_track:
            return
        stamp_ns = feedback[0].stamp_ns
        by_track |= self._slots.bystanders.feedback(stamp_ns)
        assert self._scene is not None
        for view in self._slots.views(self._scene):
            group.correct(view, self._slots.followed(view), stamp_ns, by_track, self.config)

    def tracks(self) -> list[Track]:
        """Return who is tracked, in the order of their slots."""
        return self._slots.tracks()

    def _predict(self, scene: Scene, image: NDArray[np.uint8], heat: HeatMap | None) -> None:
        """
        Take a frame into the scene, and predict all tracks into it.

        After a gap they are lost, to be looked for from where they were: nothing tells how they
        went.
        """
        gap_s = scene.gap_s(self._stamp_ns)
        if gap_s > GAP_S:
            self._slots.go_over(scene, self._stamp_ns, self._starter, gap_s)
            self._slots.bystanders.clear()
            for track in self.tracks():
                track.stop()
        silhouettes: dict[int, NDArray[np.uint8]] = {}
        people: dict[View, Whereabouts] = {}
        for view in self._slots.views(scene):
            tracks = self._slots.followed(view)
            silhouettes |= group.visible_silhouettes(tracks)
            areas = tuple(track.pose.area for track in tracks)
            people[view] = Whereabouts(areas, any(track.state == LOST for track in tracks))
        options = self.config.scene_options
        scene.advance(image, self._stamp_ns, people, heat=heat, options=options)
        for track in self._slots.followed():
            if scene.fades:
                track.fade(NO_GRADIENT if track.view.now.image.textured else NO_CHROMA)
            track.predict(silhouettes.get(track.track_id))

    def _observe(self, scene: Scene) -> list[TrackResult]:
        """Compute the likelihoods of a frame, refine the boxes by them, and look for the lost."""
        likelihoods: dict[int, NDArray[np.uint8]] = {}
        for view in self._slots.views(scene):
            likelihoods |= group.observe(view, self._slots.followed(view))
        self._slots.go_over(scene, self._stamp_ns, self._starter)
        views, people = self._slots.views(scene), self._slots.tracks()
        self._slots.bystanders.update(views, people, likelihoods, self.config)
        return self._slots.results(likelihoods, self.empty(self._stamp_ns, scene.source))

    def empty(self, stamp_ns: int, source: tuple[int, int]) -> TrackResult:
        """Return the result of an empty slot; ``source`` is (H, W) of the image."""
        scale = self._slots.scale_for(source, self.config.working_height)
        shape = working_shape(*source, scale)
        return TrackResult(stamp_ns, 0, None, np.zeros(shape, np.uint8), 0.0)
