# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""People found by their walk or in heat maps: their first masks, and the slots they get."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.geometry import Box, body_window
from gait_segmentation.heat_maps import HeatMap
from gait_segmentation.images import Window
from gait_segmentation.results import LOST
from gait_segmentation.starting import Start, StartingConfig, estimate_start
from gait_segmentation.starting.finding.recollection import Recollection
from gait_segmentation.tracking.adaptive_mean_shift import start_in
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.likelihood.heat_map import HeatMapCue
from gait_segmentation.tracking.map_finder import MapFinder
from gait_segmentation.tracking.person.appearance import SAME_COLOURS
from gait_segmentation.tracking.target import Target
from gait_segmentation.tracking.world import World

__all__ = ['Arrival', 'Arrivals', 'first_mask', 'slot_for_found']

_ABOUT = 0.3
"""How far about somebody found the place is remembered, in body heights."""

_WIDEST = 0.6
"""Width of the place of somebody known in which nobody is looked for, in body heights: what is
wider is more than one body."""

_ANOTHER_BOX = 0.07
"""Distance of head and feet of the first mask from those of the box, in heights of the box, from
which somebody found is looked at once more, in the box of the mask."""


Arrival = tuple[Start, HeatMapCue]
"""The first mask of somebody, and what is known of the heat map."""


class Arrivals:
    """Finds people, and estimates their first masks from what was there before."""

    def __init__(self, bank: TemplateBank, config: StartingConfig, people: int = 1) -> None:
        """
        Begin without anything seen.

        :param bank: the templates that people are found and their first masks estimated with.
        :param people: how many are looked for at most.
        """
        self._bank, self._people = bank, people
        self.config = config

    @property
    def config(self) -> StartingConfig:
        """Return how people are found; another configuration begins anew."""
        return self._config

    @config.setter
    def config(self, config: StartingConfig) -> None:
        # Here, because the finder uses parts of this package.
        from gait_segmentation.starting import WalkerFinder

        self._config = config
        self._finder = WalkerFinder(self._bank, config, self._people)
        self._map_finder = MapFinder(self._bank)

    def reset(self) -> None:
        """Forget what was seen."""
        self._finder.reset()
        self._map_finder.reset()

    def find(
        self,
        image: NDArray[np.uint8],
        stamp_ns: int,
        occupied: Sequence[Box],
        heat_map: HeatMap | None = None,
        *,
        wanted: bool = True,
    ) -> Sequence[Box]:
        """
        Take in a frame and return the boxes of people newly found, in source pixels.

        :param image: (H, W, 3) uint8 BGR.
        :param occupied: boxes of people known already, in source pixels.
        :param heat_map: where people are as others see it, if of this frame.
        :param wanted: whether there is a slot for anybody; if not, what moves is followed only.
        """
        taken = [
            Box.from_center(
                box.center_x, box.center_y, min(box.width, _WIDEST * box.height), box.height
            )
            for box in occupied
        ]
        found = self._finder.update(image, stamp_ns, taken, wanted=wanted)
        if heat_map is None or not wanted or self.config.auto_init == 'none':
            return found
        longest = max(image.shape[:2])
        least = self.config.least_height * max(1.0, longest / self.config.search_size)
        known = [*occupied, *found]
        return [*found, *self._map_finder.update(heat_map, image.shape[:2], known, least)]

    def strangers(self, stamp_ns: int) -> NDArray[np.uint8] | None:
        """Return where people without a slot may be, (h, w) uint8 of any size, None if nowhere."""
        return self._finder.strangers(stamp_ns)

    def look_at(self, world: World, box: Box, config: TrackingConfig) -> Arrival:
        """
        Estimate a first mask before what the camera has seen of the place; the box may be off.

        :param world: in which the person is well seen; it forgets what is under the mask and
            takes over what is remembered of the place.
        :param box: in working pixels, in the world's newest frame.
        :returns: it, and what the box says of a heat map of that frame.
        """
        cue, heat = HeatMapCue(), world.now.heat
        if config.method == 'adaptive_mean_shift':
            return start_in(box, world.shape), cue
        past, window = self._past(world, box), _about(box, world)
        evidence = None if past is None else np.zeros(world.shape, np.float32)
        if evidence is not None and past is not None:
            lab = world.now.image.lab_about(window)[window]
            evidence[window] = past.evidence(lab, config.shadow_floor)
        start = self._estimate(world, box, config, evidence)
        if heat is not None and not world.now.heat_frames:
            cue.place(heat, window, start.votes[window], box.height)
            cue.begin(heat, box, window)
            if cue.weight:
                evidence = np.zeros(world.shape, np.float32) if evidence is None else evidence
                evidence[window] += cue.evidence(cue.part(heat, window))
                start = self._estimate(world, box, config, evidence)
        world.clear(start.mask)
        if past is not None:
            world.recall(past)
        return start, cue

    def _estimate(
        self,
        world: World,
        box: Box,
        config: TrackingConfig,
        evidence: NDArray[np.float32] | None,
    ) -> Start:
        """Estimate a first mask, once more if what is known shows that the box was off."""
        start = first_mask(world, box, self._bank, config, evidence)
        tight = None if evidence is None else Box.around(start.mask)
        if tight is not None:
            off = abs(tight.y - box.y), abs(tight.bottom - box.bottom)
            if max(off) > _ANOTHER_BOX * box.height:
                start = first_mask(world, tight, self._bank, config, evidence)
        return start

    def _past(self, world: World, box: Box) -> Recollection | None:
        """Return what the place about a box in working pixels looked like before."""
        window, image = _about(box, world), world.now.image
        return self._finder.recall(image.stamp_ns, image.bgr, window, textured=image.textured)


def _about(box: Box, world: World) -> Window:
    """Return the rows and columns about a box in working pixels."""
    area = body_window(box.center_x, box.center_y, box.height, box)
    area = area.padded(_ABOUT * box.height, _ABOUT * box.height)
    return area.slices(world.shape[1], world.shape[0])


def first_mask(
    world: World,
    box: Box,
    bank: TemplateBank,
    config: TrackingConfig,
    evidence: NDArray[np.float32] | None = None,
) -> Start:
    """
    Estimate the first mask of a person in the newest frame of a world.

    :param box: in working pixels.
    :param evidence: (h, w) float32 of the working image, what is known of its pixels, if anything.
    """
    return estimate_start(
        world.now.image.lab,
        box,
        bank,
        height=config.start_height,
        rounds=config.start_rounds,
        left_out=config.start_left_out,
        use_tilt=config.use_tilt,
        evidence=evidence,
    )


def slot_for_found(
    slots: Sequence[Target | None], world: World, start: Start
) -> tuple[int, int | None] | None:
    """
    Return the slot that somebody found gets, None if there is none.

    :param start: the first mask, in the newest frame of the world.
    :returns: the number of the slot, and the track id if it is the person who was lost there,
        else None.
    """
    lost = {
        slot: target
        for slot, target in enumerate(slots)
        if target is not None and target.state == LOST
    }
    alike = {slot: target.memory.likeness(start, world.now) for slot, target in lost.items()}
    best = max(alike, key=lambda slot: alike[slot], default=None)
    if best is not None and alike[best] >= SAME_COLOURS:
        return best, lost[best].track_id
    if None in slots:
        return list(slots).index(None), None
    if lost:
        return max(lost, key=lambda slot: lost[slot].memory.lost_s), None
    return None
