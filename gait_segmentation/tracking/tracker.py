# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The tracking stage: frames in, boxes and foreground likelihood images of people out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.colour import NO_CHROMA, NO_GRADIENT
from gait_segmentation.detector.detection import Detection
from gait_segmentation.detector.scheduler import DetectorScheduler
from gait_segmentation.detector.sources import Seen, Sources
from gait_segmentation.errors import InputError
from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.geometry import Box, check_start_box
from gait_segmentation.images import check_image
from gait_segmentation.results import LOST, Feedback, TrackResult
from gait_segmentation.scene.scene import Scene
from gait_segmentation.scene.working import working_shape
from gait_segmentation.stamps import check_later, check_stamp
from gait_segmentation.starting import StartingConfig
from gait_segmentation.tracking import group
from gait_segmentation.tracking.association import explain
from gait_segmentation.tracking.beginning import Beginner
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.drawing import draw_known, draw_new
from gait_segmentation.tracking.factory import TrackFactory
from gait_segmentation.tracking.group import keep_own, own_feedback
from gait_segmentation.tracking.people import GAP_S, People
from gait_segmentation.tracking.track import Track

_NEW_NS = 600_000_000
"""Age of a look up to which somebody new is found near where they were then."""


class PeopleTracker:
    """
    Tracks people: detections in, tracks out.

    Those who are taken for people get a slot while there is one, given boxes first, then the
    tallest; only they are published.  Who is near one of them is followed as well, so that each
    takes their own pixels along.  Once a box is given by :meth:`initialize`, whoever gives boxes
    is to give all.

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
        scheduler: DetectorScheduler | None = None,
    ) -> None:
        """
        Make a tracker without a track.

        :param bank: the templates that first masks are estimated with.
        :param max_people: number of slots.
        :param starting: how people are found without a box.
        :param scheduler: what has networks look at images; if None the package's detector, in
            lockstep.
        """
        scheduler = scheduler or DetectorScheduler()
        self._sources = Sources(bank, starting or StartingConfig(), scheduler)
        self._factory, self._slots = TrackFactory(bank, tracking or TrackingConfig()), max_people
        self._beginner = Beginner(self._factory)
        self.reset()

    @property
    def config(self) -> TrackingConfig:
        """Return the configuration in force; it may be exchanged between frames."""
        return self._factory.config

    @config.setter
    def config(self, config: TrackingConfig) -> None:
        self._factory.config = config
        for track in self._people.tracks:
            track.configure(config)

    @property
    def starting(self) -> StartingConfig:
        """Return how people are found; it may be exchanged between frames."""
        return self._sources.config

    @starting.setter
    def starting(self, config: StartingConfig) -> None:
        self._sources.config = config

    def reset(self, *, waiting: bool = True) -> None:
        """
        Forget all people and the place, but the track ids given so far.

        :param waiting: whether to forget the boxes and maps that wait for the next frame, too.
        """
        self._people = People(self._slots)
        self._beginner.forget()
        self._scene: Scene | None = None
        self._stamp_ns = 0
        self._sources.reset(waiting=waiting)
        if waiting:
            self._boxes: list[Box] = []
            self._given = False

    def initialize(self, box: Box) -> None:
        """
        Start a new track at the next frame.

        A box on a person who is tracked begins that slot anew; any other takes a free slot, or
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
        self._sources.add_heat_map(heat_map, stamp_ns)

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
        given, self._boxes = self._boxes, []
        self._given = self._given or bool(given)
        # Before the boxes: what the camera saw until now tells what in them is the person.
        at_first = bool(given) and not scene.views
        self._predict(scene, image)
        seen = self._look(image)
        scene.show(seen.heat)
        new = self._associate(scene, seen)
        people, draw = self._people, partial(self._sources.draw, image, stamp_ns)
        masks = draw(given)
        found = people.follow(new, seen.stamp_ns, seen.by_map, scene, self._beginner.moves)
        late = seen.stamp_ns < stamp_ns
        found = draw_new(draw, found, stamp_ns, max(scene.source), late=late)
        draw_known(draw, people.tracked, stamp_ns)
        self._beginner.remember(scene, people, wanted=not (at_first or self._is_given))
        self._beginner.begin_anew(scene, people)
        self._beginner.begin_given(scene, people, given, masks)
        self._beginner.begin_found(scene, people, found, given=self._is_given)
        people.reunite()
        likelihoods = self._observe(scene)
        return self._results(scene, likelihoods)

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
        people = self._people
        known = {track.track_id for track in people.tracks}
        by_track = {each.track_id: each for each in feedback if each.track_id in known}
        for each in by_track.values():
            each.check(None if self._scene is None else self._scene.source)
        if not by_track:
            return
        stamp_ns = feedback[0].stamp_ns
        for track in people.tracks:
            if (own := own_feedback(track, stamp_ns)) is not None:
                by_track[track.track_id] = own
        for view in people.views:
            group.correct(view, people.seen_in(view), stamp_ns, by_track, self.config)

    def tracks(self) -> list[Track]:
        """Return who has a slot, in the order of the slots."""
        return self._people.published

    @property
    def _is_given(self) -> bool:
        """Return whether whoever gives boxes is to give all people."""
        return self._given and bool(self.tracks())

    def _scene_of(self, source: tuple[int, int]) -> Scene:
        """Return the scene of images of a size, a new one if no view has followed the place."""
        if self._scene is not None and source != self._scene.source:
            self.reset(waiting=False)
        if self._scene is None or not self._scene.views:
            self._scene = Scene(source)
            self._beginner.forget()
        return self._scene

    def _predict(self, scene: Scene, image: NDArray[np.uint8]) -> None:
        """
        Take a frame into the scene, and predict all tracks into it.

        After a gap they are lost, to be looked for from where they were: nothing tells how they
        went.
        """
        people, gap_s = self._people, scene.gap_s(self._stamp_ns)
        if gap_s > GAP_S:
            people.live(self._stamp_ns, gap_s)
            for track in people.tracks:
                track.stop()
        silhouettes: dict[int, NDArray[np.uint8]] = {}
        for view in people.views:
            silhouettes |= group.visible_silhouettes(people.seen_in(view))
        regions = {view: people.regions(view) for view in people.views}
        scene.advance(image, self._stamp_ns, regions, options=self.config.scene_options)
        for track in people.tracks:
            if scene.fades:
                track.fade(NO_GRADIENT if track.view.now.image.textured else NO_CHROMA)
            track.predict(silhouettes.get(track.track_id))

    def _look(self, image: NDArray[np.uint8]) -> Seen:
        """Have everybody look who sees people."""
        people = self._people
        return self._sources.look(
            image,
            self._stamp_ns,
            boxes=bool(self.tracks()) or not self._given,
            bodies=people.bodies,
            urgent=people.is_missing(self._stamp_ns, others=not self._given),
            small=partial(people.has_small, others=not self._given),
            unsure=[] if self._given else people.unsure(self._stamp_ns),
            heat_map_age=self.config.heat_map_age,
            since_ns=people.known_since_ns,
        )

    def _associate(self, scene: Scene, seen: Seen) -> list[Detection]:
        """
        Give detections to tracks, each in the frame that they are of.

        :returns: those of nobody who is tracked, the best first, if that was just now.
        """
        least = self.starting.least_height * max(scene.source)
        others = [each for each in explain(self._people.tracks, seen) if each.box.height >= least]
        is_old = self._stamp_ns - seen.stamp_ns > _NEW_NS
        return [] if is_old else sorted(others, key=lambda each: -each.score)

    def _observe(self, scene: Scene) -> dict[int, NDArray[np.uint8]]:
        """Compute the likelihoods of a frame, refine the boxes by them, and look for the lost."""
        people = self._people
        likelihoods: dict[int, NDArray[np.uint8]] = {}
        for view in people.views:
            likelihoods |= group.observe(view, people.seen_in(view))
        if not self._is_given:
            people.number(self._stamp_ns)
        people.live(self._stamp_ns)
        for track in people.tracks:
            if track.slot is None and track.track_id in likelihoods:
                others = [each for each in people.published if each.view is track.view]
                track.see_map()
                keep_own(track, likelihoods[track.track_id], others)
        scene.keep(people.views)
        return likelihoods

    def _results(
        self, scene: Scene, likelihoods: Mapping[int, NDArray[np.uint8]]
    ) -> list[TrackResult]:
        """Return the result of each slot."""
        results, people = [], self._people
        for track, reason in zip(people.by_slot, people.reasons, strict=True):
            if track is None:
                results.append(replace(self.empty(self._stamp_ns, scene.source), reason=reason))
                continue
            likelihood = likelihoods.get(track.track_id)
            if likelihood is None or track.state == LOST:
                likelihood = np.zeros(track.view.shape, np.uint8)
            results.append(track.result(likelihood))
        return results

    def empty(self, stamp_ns: int, source: tuple[int, int]) -> TrackResult:
        """Return the result of an empty slot; ``source`` is (H, W) of the image."""
        scale = self._factory.scale_for(source, self.config.working_height)
        likelihood = np.zeros(working_shape(*source, scale), np.uint8)
        return TrackResult(stamp_ns, 0, None, likelihood, 0.0)
