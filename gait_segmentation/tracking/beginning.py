# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Who begins: the people in boxes that were given, and those who were detected."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import zip_longest

from gait_segmentation.detector.detection import PART, Detection, SoftMask
from gait_segmentation.geometry import Box
from gait_segmentation.results import TRACKED
from gait_segmentation.scene.place import PlaceMemory
from gait_segmentation.scene.scene import Scene, View
from gait_segmentation.starting import FirstMask
from gait_segmentation.tracking.existence import Existence
from gait_segmentation.tracking.factory import TrackFactory
from gait_segmentation.tracking.people import People, slim
from gait_segmentation.tracking.reidentification import recognized
from gait_segmentation.tracking.tentative import Tentative
from gait_segmentation.tracking.track import Track


class Beginner:
    """Begins tracks before what the place looks like without people, which it remembers."""

    def __init__(self, factory: TrackFactory) -> None:
        self._factory = factory
        self._place: PlaceMemory | None = None

    def forget(self) -> None:
        """Forget the place: another scene is shown from now on."""
        self._place = None

    def remember(self, scene: Scene, people: People, *, wanted: bool) -> None:
        """Learn the place in the newest frame beside people, while others may begin."""
        published, place = people.published, self._place
        wanted = wanted and (people.slots > 1 or len(published) < people.slots)
        if place is not None and (not wanted or place.is_old(scene.stamp_ns)):
            place.close()
            self._place = place = None
        if wanted:
            self._place = place = place or PlaceMemory(scene, fine=people.slots > 1)
            place.update([slim(track.body) for track in published if track.state == TRACKED])

    def moves(self, box: Box) -> bool:
        """Return whether a box, in source pixels, shows somebody new who moves."""
        return self._place is not None and self._place.moves(box)

    def begin_given(
        self, scene: Scene, people: People, boxes: Sequence[Box], masks: Sequence[SoftMask]
    ) -> None:
        """
        Begin with the people in boxes that were given, in source pixels.

        :param masks: what a network has drawn in the first of them.
        """
        begun: list[Track] = []
        for box, mask in zip_longest(boxes, masks):
            slot = people.slot_for(box, begun)
            people.free(slot)
            given, existence = Detection(box, 1.0, mask), Existence(scene.stamp_ns, given=True)
            begun.append(self._begin(scene, people, given, existence, slot))

    def begin_anew(self, scene: Scene, people: People) -> None:
        """Begin anew, with the same id, with people of whom only a part has been followed."""
        for track in people.tracked:
            if track.is_part:
                box = track.detected_in(scene.stamp_ns)
                whole, existence = Detection(box, 1.0, track.drawn_now()), track.existence
                self._begin(scene, people, whole, existence, track.slot, track.track_id)

    def begin_found(
        self, scene: Scene, people: People, found: Sequence[Tentative], *, given: bool
    ) -> None:
        """
        Begin with who was detected and is taken for a person, the tallest first.

        :param given: whether whoever gives boxes is to give all people.
        """
        left: list[Tentative | None] = []
        for each in sorted(found, key=lambda tentative: -tentative.detection.box.height):
            begun = [
                track for track in people.tracks if track.history.states[0].frame is track.view.now
            ]
            if all(track.body.common_share(each.detection.box) <= PART for track in begun):
                left.append(self._begin_one(scene, people, each, given=given))
        people.wait(each for each in left if each is not None)

    def _begin_one(
        self, scene: Scene, people: People, each: Tentative, *, given: bool
    ) -> Tentative | None:
        """Begin with somebody who was detected, and return None, if there is a reason to."""
        detection, existence, near = each.detection, each.existence, None
        is_person = existence.is_person(scene.stamp_ns)
        lost = people.doubted if is_person else []
        free = is_person and not given and people.has_room(detection.box.height)
        # A region of a map has an outline, and so may take its pixels along at once.
        if self._factory.config.use_bystanders and (is_person or detection.by_map):
            near = people.near(self._factory.tight(detection), by_map=detection.by_map)
        if not (free or near) and (not lost or each.was_compared(scene.stamp_ns)):
            return each
        view = None if free or near is None else near.view
        view, start = self._estimate(scene, people, detection, view)
        before = recognized(lost, view, start)
        if before is None and not (free or near):
            return replace(each, compared_ns=scene.stamp_ns)
        slot = number = None
        if before is not None:
            slot, number, existence = before.slot, before.track_id, before.existence.seen_again()
        elif free:
            slot = people.make_room()
        make = self._factory.make
        people.add(make(view, start, detection, existence, slot=slot, number=number))
        return None

    def _begin(
        self,
        scene: Scene,
        people: People,
        detection: Detection,
        existence: Existence,
        slot: int | None,
        number: int | None = None,
    ) -> Track:
        """Begin with somebody who was detected, in a slot or none, and return the track."""
        view, start = self._estimate(scene, people, detection)
        track = self._factory.make(view, start, detection, existence, slot=slot, number=number)
        people.add(track)
        return track

    def _estimate(
        self, scene: Scene, people: People, detection: Detection, view: View | None = None
    ) -> tuple[View, FirstMask]:
        """Return a view for somebody, and the first mask in it; see :class:`.TrackFactory`."""
        past = None if self._place is None else self._place.known
        return self._factory.estimate(scene, detection, people.views, past, view)
