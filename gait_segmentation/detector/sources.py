# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whoever sees people: the networks of this process, and the heat maps of others."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.detector.detection import Detection
from gait_segmentation.detector.map_regions import BodyShapes, MapRegions
from gait_segmentation.detector.person_detector import CLOSER_SHARE, LEAST_SHARE
from gait_segmentation.detector.scheduler import DetectorScheduler
from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.geometry import Box
from gait_segmentation.heat_maps import HeatMap, HeatMaps
from gait_segmentation.starting.config import StartingConfig

_LATEST_NS = 1_000_000_000
"""Age from which on a look tells nothing of now, though slow computers need long for one."""


class Seen(NamedTuple):
    """
    What is said of people at a frame.

    ``people`` are those that a detector saw, in the frame of ``stamp_ns``, None where it did not
    look, from ``least_height`` on, in source pixels; ``by_map`` are the regions of the newest heat
    map, and ``heat`` is that map, None if there is none.
    """

    stamp_ns: int
    people: tuple[Detection, ...] | None = None
    by_map: tuple[Detection, ...] = ()
    heat: HeatMap | None = None
    least_height: float = 0.0


class Sources:
    """Has all those look who see people, each when it is time."""

    def __init__(
        self, bank: TemplateBank, config: StartingConfig, scheduler: DetectorScheduler
    ) -> None:
        self.config, self._scheduler = config, scheduler
        self.draw = scheduler.draw
        """Draws people, see :meth:`.DetectorScheduler.draw`."""

        self._shapes = BodyShapes(bank)
        self.reset()

    def reset(self, *, waiting: bool = True) -> None:
        """Look at another film; ``waiting`` says whether to forget the maps that wait, too."""
        self._scheduler.reset()
        self._regions = MapRegions(self._shapes)
        if waiting:
            self._heat_maps = HeatMaps()
        self._heat_maps.forget()

    def add_heat_map(self, heat_map: NDArray[Any], stamp_ns: int) -> None:
        """Take in a heat map; InputError, see :func:`.heat_map_of`."""
        self._heat_maps.add(heat_map, stamp_ns)

    def look(
        self,
        image: NDArray[np.uint8],
        stamp_ns: int,
        *,
        boxes: bool,
        bodies: tuple[Sequence[Box], Sequence[Box]],
        urgent: bool,
        small: Callable[[float], bool],
        unsure: Sequence[Box],
        heat_map_age: float,
        since_ns: int,
    ) -> Seen:
        """
        Take in a frame, and return what is said of it and of the last ones.

        :param image: (H, W, 3) uint8 BGR.
        :param boxes: whether it is asked who is in the image.
        :param bodies: of who is known to a map, and of who is lost, whom it may show again.
        :param urgent: whether somebody is missing.
        :param small: tells whether people below a height in source pixels are to be seen.
        :param unsure: boxes of who may be somebody: the smaller ones are looked at closely.
        :param heat_map_age: up to which a heat map counts, in seconds.
        :param since_ns: stamp from which on it is known where everybody was.
        """
        longest = max(image.shape[:2])
        seen = self._scheduler.look(
            image,
            stamp_ns,
            boxes=boxes,
            urgent=urgent,
            small=small(LEAST_SHARE * longest),
            unsure=[each for each in unsure if each.height < CLOSER_SHARE * longest],
        )
        if seen is not None and seen.heat_map is not None:
            self.add_heat_map(seen.heat_map, seen.stamp_ns)
        if seen is not None and seen.stamp_ns < max(stamp_ns - _LATEST_NS, since_ns):
            seen = None
        heat = self._heat_maps.newest(image, stamp_ns, heat_map_age)
        source = (image.shape[0], image.shape[1])
        least = self.config.least_height * longest
        by_map: list[Detection] = []
        if heat is not None and heat.stamp_ns == stamp_ns:
            known, lost = bodies
            if seen is not None and seen.people is not None:
                known = [*known, *(each.box for each in seen.people)]
            by_map = self._regions.detect(heat, source, least, known, lost)
        if seen is None:
            return Seen(stamp_ns, by_map=tuple(by_map), heat=heat)
        return Seen(seen.stamp_ns, seen.people, tuple(by_map), heat, seen.least_share * longest)
