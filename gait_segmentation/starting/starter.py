# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Who is to get a slot without a box: by their walk, by a heat map, or by the detector."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.detector.lookout import Lookout, Sighting
from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.geometry import Box
from gait_segmentation.heat_maps import HeatMap
from gait_segmentation.scene.scene import Scene, WholeView
from gait_segmentation.starting.blobs import BodyShapes
from gait_segmentation.starting.config import StartingConfig
from gait_segmentation.starting.finder import WalkerFinder
from gait_segmentation.starting.map_finder import MapFinder
from gait_segmentation.starting.sightings import Sightings

BY_WALK, BY_MAP, BY_DETECTOR = 'walk', 'map', 'detector'
"""What people are found by."""

_MOST_THINGS, _SAME_THING = 32, 0.3
"""Things that are remembered, and intersection over union of boxes that are of the same."""

_PART, _ABOUT = 0.75, 0.25
"""
Height of what may be left of somebody who leaves the image, and how far beside them it may be, in
their heights.
"""


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
        """
        Begin without having seen anything.

        :param bank: the templates that people are found with.
        :param slots: how many people there may be.
        :param lookout: who looks at whole images.
        """
        self.config = config
        self.walkers = WalkerFinder(bank, config, slots)
        self._slots, self._lookout = slots, lookout
        self._shapes = BodyShapes(bank)
        self.forget()

    def forget(self) -> None:
        """Forget all that was seen, for another place is shown from now on."""
        self.walkers.stop()
        self._maps, self._sightings = MapFinder(self._shapes), Sightings()
        self._things = deque[Box](maxlen=_MOST_THINGS)
        self._lookout.reset()

    @property
    def background(self) -> WholeView | None:
        """Return the scene as it was before there were people, None if it is not known."""
        return self.walkers.background

    def reject(self, box: Box) -> None:
        """Take nobody any more for a person who is seen just there, where a thing is."""
        self._things.append(box)

    def _is_thing(self, box: Box) -> bool:
        return any(box.iou(thing) > _SAME_THING for thing in self._things)

    def look(self, image: NDArray[np.uint8], stamp_ns: int, known: Known) -> Sighting | None:
        """
        Have the networks look at a frame, if it is time; see :meth:`Lookout.look`.

        :param image: (H, W, 3) uint8 BGR.
        """
        anybody = bool(known.seen or known.lost)
        asked = self.config.auto_init == 'detector' and (anybody or not known.given)
        urgent = not anybody or known.lost or known.silent or self._sightings.waiting
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

        :param heat: the newest heat map.
        :param at_first: whether boxes were given before there was anything to remember.
        """
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
        asked = self.config.auto_init == 'detector' and free
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
        about = body.padded(_ABOUT * body.height, _ABOUT * body.height)
        if not inside and box.height < _PART * body.height and about.iou(box) > 0:
            return True
    return False
