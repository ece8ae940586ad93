# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Who is to get a slot without a box: by their walk, by a heat map, or by the detector."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from itertools import takewhile
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.detector.lookout import Lookout, Sighting
from gait_segmentation.detector.person_detector import Detection
from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.geometry import Box
from gait_segmentation.heat_maps import HeatMap, label_regions
from gait_segmentation.scene.scene import Scene, WholeView
from gait_segmentation.starting.finder import StartingConfig, WalkerFinder, belongs
from gait_segmentation.starting.shapes import BodyShapes, normalised

BY_WALK, BY_MAP, BY_DETECTOR = 'walk', 'map', 'detector'
"""What people are found by."""

# Scores from which somebody is a person at once, when they are seen again, and when they have
# moved until then: a coat on a hook looks a little like a person for as long as it hangs there.
SURE = 0.6
_SURE_IF_AGAIN = 0.5
_SURE_IF_MOVED = 0.3
_AGAIN_NS = 1_000_000_000  # within which somebody must be seen again
_AGAIN_IOU = 0.1  # of two boxes from which they may be of one person
_MOVED = 0.1  # how far somebody has moved who is no thing, in heights of their box
# Values of a map from which regions are made: at an eighth what a network is unsure of is part of
# a body; at one half people who touch may be apart.
_MAP_LEVELS = 32, 127
# Tanimoto similarity with the best template from which a region may be a body, and how much more
# it must be in sum over maps in a row: the clear shape of a body is enough at once.
_LIKE_A_BODY = 0.1
_ENOUGH = 0.2
_MOST_THINGS = 32  # that are remembered
_THING_NS = 30_000_000_000  # for which they are
_THING_IOU = 0.3  # of two boxes that are of the same thing
# Of what may be left of somebody who leaves the image: its height over theirs, and how far beside
# them it may be, in their heights.
_LEFT_HEIGHT = 0.75
_LEFT_BESIDE = 0.25


class Proposal(NamedTuple):
    """Somebody found: a box in source pixels, and what they are found by."""

    box: Box
    source: str


class Known(NamedTuple):
    """
    Whom a tracker knows, as boxes in source pixels.

    ``tracked`` are bodies, no wider than one, ``tried`` those of people on trial, ``visible`` what
    can be seen of either, and the bodies as they are, ``lost`` the bodies of those who are, where
    they are expected; of ``silent`` ones the last look saw nothing.  With ``given`` boxes whoever
    gives them is to give all.
    """

    tracked: tuple[Box, ...] = ()
    tried: tuple[Box, ...] = ()
    visible: tuple[Box, ...] = ()
    lost: tuple[Box, ...] = ()
    silent: bool = False
    given: bool = False

    @property
    def seen(self) -> int:
        """Return how many are tracked."""
        return len(self.tracked) + len(self.tried)


class Starter:
    """
    Looks for people while a slot is free or waits for a lost person.

    Once a box is given, only the lost are looked for.
    """

    def __init__(
        self, bank: TemplateBank, config: StartingConfig, slots: int, lookout: Lookout
    ) -> None:
        """Begin without having seen anything; there may be so many people as ``slots``."""
        self.config = config
        self.walkers = WalkerFinder(bank, config, slots)
        self._slots, self._lookout = slots, lookout
        self._shapes = BodyShapes(bank)
        self.forget()

    def forget(self) -> None:
        """Forget all that was seen, for another place is shown from now on."""
        self.walkers.stop()
        self._maps, self._sightings = MapFinder(self._shapes), Sightings()
        self._things = deque[tuple[Box, int]](maxlen=_MOST_THINGS)
        self._lookout.reset()

    @property
    def background(self) -> WholeView | None:
        """Return the scene as it was before there were people, None if it is not known."""
        return None if self.walkers.detector is None else self.walkers.detector.known

    def reject(self, box: Box, stamp_ns: int) -> None:
        """Take nobody for a person, for a time, who is seen just there, where a thing is."""
        self._things.append((box, stamp_ns + _THING_NS))

    def _is_thing(self, box: Box) -> bool:
        return any(box.iou(thing) > _THING_IOU for thing, _ in self._things)

    def _forget_things(self, scene: Scene) -> None:
        """Forget things of long ago, which may be people after all, and all when they move."""
        if any(view.now.motion.camera is not None for view in scene.views):
            self._things.clear()
        while self._things and self._things[0][1] < scene.stamp_ns:
            self._things.popleft()

    def look(self, image: NDArray[np.uint8], stamp_ns: int, known: Known) -> Sighting | None:
        """
        Have the networks look at a frame, if it is time; see :meth:`Lookout.look`.

        :param image: (H, W, 3) uint8 BGR.
        """
        anybody = bool(known.seen or known.lost)
        asked = self.config.auto_init == 'detector' and (anybody or not known.given)
        waiting = self._sightings.waiting and known.seen < self._slots and not known.given
        urgent = not anybody or known.lost or known.silent or waiting
        return self._lookout.look(image, stamp_ns, boxes=asked, urgent=bool(urgent))

    def propose(
        self,
        scene: Scene,
        heat: HeatMap | None,
        sighting: Sighting | None,
        known: Known,
        *,
        at_first: bool = False,
    ) -> list[Proposal]:
        """
        Return whom the newest frame of a scene shows, in the order in which they get slots.

        The detector also shows those for whom there is none.

        :param heat: the newest heat map.
        :param at_first: whether boxes were given before there was anything to remember.
        """
        self._forget_things(scene)
        free, anybody = known.seen < self._slots, bool(known.seen or known.lost)
        given = known.given and anybody
        found: list[Proposal] = []
        if at_first or given or not (free or known.tried or self._slots > 1):
            self.walkers.stop()
        else:
            # Also while nobody is looked for: it remembers what the place looks like.
            wanted = bool(free or known.tried) and self.config.auto_init == 'walk'
            wanted = wanted and not known.given
            walkers = self.walkers.update(scene, known.tracked, tried=known.tried, wanted=wanted)
            found += [Proposal(box, BY_WALK) for box in walkers if free]
        searched = max(1.0, max(scene.source) / self.config.search_size)
        least = self.config.least_height * searched
        # A person who is lost is looked for in maps though boxes are given.
        wanted = bool(known.lost) if known.given else free
        wanted = wanted and (self.config.auto_init != 'none' or given)
        if wanted and heat is not None and heat.stamp_ns == scene.stamp_ns:
            boxes = [*known.tracked, *known.tried, *(each.box for each in found)]
            shown = self._maps.update(heat, scene.source, boxes, least)
            people = [*known.tracked, *known.lost]
            found += [
                Proposal(box, BY_MAP)
                for box in shown
                if not (self._is_thing(box) or _is_part(box, people, scene.source))
            ]
        asked = self.config.auto_init == 'detector'
        if asked and sighting is not None and sighting.people is not None:
            boxes = [*(each.box for each in found), *known.visible]
            others = [each for each in sighting.people if not self._is_thing(each.box)]
            seen = self._sightings.update(sighting.stamp_ns, others, boxes, least)
            found += [Proposal(box, BY_DETECTOR) for box in seen]
        return found


def _is_part(box: Box, people: Sequence[Box], source: tuple[int, int]) -> bool:
    """Return whether a region is what is left of somebody who leaves an image of (H, W)."""
    for body in people:
        inside = body.x >= 0 and body.right <= source[1] and body.bottom <= source[0]
        about = body.padded(_LEFT_BESIDE * body.height, _LEFT_BESIDE * body.height)
        if not inside and box.height < _LEFT_HEIGHT * body.height and about.iou(box) > 0:
            return True
    return False


class Sightings:
    """Remembers whom the detector saw first when and where, while they are ``waiting``."""

    def __init__(self) -> None:
        self.waiting: list[tuple[int, Box]] = []

    def update(
        self, stamp_ns: int, people: Sequence[Detection], occupied: Sequence[Box], least: float
    ) -> list[Box]:
        """
        Take in a look at the whole image, and return the people newly found, the tallest first.

        :param occupied: boxes of who is tracked, like all others in source pixels.
        :param least: height of who is found.
        """
        before, self.waiting = self.waiting, []
        found = []
        for person in people:
            box = person.box
            unlikely = person.score < _SURE_IF_MOVED or box.height < least
            if unlikely or belongs(box, occupied):
                continue
            last = max(before, key=lambda seen: box.iou(seen[1]), default=None)
            if last and (stamp_ns - last[0] > _AGAIN_NS or box.iou(last[1]) < _AGAIN_IOU):
                last = None
            if person.score >= SURE or (
                last and (person.score >= _SURE_IF_AGAIN or _has_moved(last[1], box))
            ):
                found.append(box)
            else:
                self.waiting.append(last or (stamp_ns, box))
        return sorted(found, key=lambda box: -box.height)


def _has_moved(before: Box, now: Box) -> bool:
    dx, dy = now.center_x - before.center_x, now.center_y - before.center_y
    return math.hypot(dx, dy) >= _MOVED * now.height


class MapFinder:
    """Finds people in heat maps: regions that have the shape of a body."""

    def __init__(self, shapes: BodyShapes) -> None:
        self._shapes = shapes
        self._stamp_ns = 0
        self._regions: list[tuple[Box, float]] = []
        """What may be a body, in source pixels, and how sure that is by now."""

    def update(
        self, heat: HeatMap, source: tuple[int, int], occupied: Sequence[Box], least: float
    ) -> list[Box]:
        """
        Take in a map, once, and return the boxes of people newly found, the tallest first.

        :param source: (H, W) of the frames.
        :param occupied: boxes of people known already, like all others in source pixels.
        :param least: height of who is found.
        """
        if heat.stamp_ns == self._stamp_ns or not heat.trust:
            return []
        self._stamp_ns = heat.stamp_ns
        before, self._regions = self._regions, []
        for box, evidence in self._bodies(heat.values, source, occupied, least):
            past = (known for other, known in before if belongs(other, [box]))
            self._regions.append((box, evidence + max(past, default=0.0)))
        self._regions.sort(key=lambda region: -region[0].height)
        # A taller one who is not sure yet may be so with the next map, and there may be one slot.
        found = list(takewhile(lambda region: region[1] >= _ENOUGH, self._regions))
        del self._regions[: len(found)]
        return [box for box, _ in found]

    def _bodies(
        self,
        values: NDArray[np.uint8],
        source: tuple[int, int],
        occupied: Sequence[Box],
        least: float,
    ) -> list[tuple[Box, float]]:
        """Return the regions that may be a body, none of them a part of another one."""
        across, down = source[1] / values.shape[1], source[0] / values.shape[0]
        regions: list[tuple[float, Box]] = []
        for level in _MAP_LEVELS:
            labels, stats = label_regions(values, level)
            for number, (x, y, w, h, _) in enumerate(stats[1:].tolist(), 1):
                box = Box(x * across, y * down, w * across, h * down)
                if box.height < least or belongs(box, occupied):
                    continue
                region = cv2.inRange(labels[y : y + h, x : x + w], number, number)
                shape = normalised(region, box.width / box.height)
                regions.append((self._shapes.likeness(shape), box))
        # Of a region and its parts the one that shows most of a body.
        regions.sort(key=lambda region: -region[0] * region[1].height ** 2)
        whole: list[tuple[Box, float]] = []
        for likeness, box in regions:
            if all(box.iou(other) == 0 for other, _ in whole):
                whole.append((box, likeness - _LIKE_A_BODY))
        return [(box, evidence) for box, evidence in whole if evidence > 0]
