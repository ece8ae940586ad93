# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""People found by their walk or in heat maps: their first masks, and the slots they get."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import takewhile

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.geometry import Box, body_window
from gait_segmentation.heat_maps import HeatMap
from gait_segmentation.images import Window
from gait_segmentation.results import LOST
from gait_segmentation.starting import FirstMask, estimate_first_mask
from gait_segmentation.starting.blobs import BodyShapes, normalised
from gait_segmentation.starting.finder import belongs
from gait_segmentation.starting.motion_scene import MotionScene
from gait_segmentation.tracking.adaptive_mean_shift import start_in
from gait_segmentation.tracking.appearance import SAME_COLOURS
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.cues.heat_map import HeatMapCue
from gait_segmentation.tracking.target import Target
from gait_segmentation.tracking.world import World

_ABOUT = 0.3
"""How far about somebody found the place is remembered, in body heights."""

_LEVELS = 32, 127
"""
Values of a map from which regions are made: at an eighth what a network is unsure of is part of a
body; at one half people who touch may be apart.
"""

_ALIKE, _ENOUGH = 0.3, 0.2
"""
Tanimoto similarity with the best template from which a region may be a body, and how much more it
must be in sum over maps in a row: the clear shape of a body is enough at once.
"""

_SAME = 0.3
"""Overlap (intersection over union) of the boxes of one person in two maps."""


Arrival = tuple[FirstMask, HeatMapCue]
"""The first mask of somebody, and what is known of the heat map."""


def look_at(
    world: World,
    box: Box,
    past: MotionScene | None,
    bank: TemplateBank,
    config: TrackingConfig,
    *,
    by_map: bool = False,
) -> Arrival:
    """
    Estimate a first mask before what the camera has seen of the place; the box may be off.

    :param world: in which the person is well seen; it forgets what is under the mask and takes
        over what is remembered of the place.
    :param box: in working pixels, in the world's newest frame.
    :param past: the place as it was before that frame, if it is known.
    :param by_map: whether the heat map of that frame is what tells of the person.
    :returns: it, and what the box says of a heat map of that frame.
    """
    cue, heat = HeatMapCue(), world.now.heat
    if config.method == 'adaptive_mean_shift':
        return start_in(box, world.shape), cue
    area = body_window(box.center_x, box.center_y, box.height, box)
    area = area.padded(_ABOUT * box.height, _ABOUT * box.height)
    window = area.slices(world.shape[1], world.shape[0])
    known = None if past is None else past.background(world.shape)
    evidence = np.zeros(world.shape, np.float32)
    if known is not None:
        lab = world.now.image.lab_part(window)
        evidence[window] = known.evidence(lab, window, config.shadow_floor)
    estimate = partial(
        estimate_first_mask,
        world.now.image.lab,
        box,
        bank,
        use_tilt=config.use_tilt,
        evidence=evidence,
    )
    start = estimate()
    if heat is not None and not world.now.heat_frames:
        # The box tells as much of where the person is as a first mask that may be poor.
        share = np.float32(1 if by_map else 0.5)
        likely = (1 - share) * start.votes
        there = box.slices(world.shape[1], world.shape[0])
        likely[there] += share * heat[there] / np.float32(255)
        cue.place(heat, window, likely[window], box.height)
        cue.begin(heat, box, window)
        if cue.weight:
            shown = cue.evidence_of(cue.part(heat, window))
            evidence[window] += shown
            start = estimate()
            if by_map:
                start = _as_shown(start, shown, window)
    world.clear(start.mask)
    if known is not None:
        world.adopt(known)
    return start, cue


def _as_shown(start: FirstMask, logit: NDArray[np.float32], window: Window) -> FirstMask:
    """
    Return a start with the mask that a heat map shows.

    By the silhouette there somebody is known for a body, while the box may hold a cabinet as well
    that continues them.

    :param logit: (h, w) float32 of the window, what the map says.
    """
    inside = np.zeros_like(start.votes)
    inside[start.box.slices(*inside.shape[::-1])] = 1
    votes = np.zeros_like(inside)
    votes[window] = inside[window] / (1 + np.exp(-logit))
    return replace(start, mask=np.where(votes > 0.5, np.uint8(255), np.uint8(0)), votes=votes)


def slot_for_found(
    slots: Sequence[Target | None], world: World, start: FirstMask
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
    alike = {slot: target.likeness(start, world.now) for slot, target in lost.items()}
    best = max(alike, key=lambda slot: alike[slot], default=None)
    if best is not None and alike[best] >= SAME_COLOURS:
        return best, lost[best].track_id
    if None in slots:
        return list(slots).index(None), None
    if lost:
        return max(lost, key=lambda slot: lost[slot].lost_s), None
    return None


class MapFinder:
    """Finds people in heat maps."""

    def __init__(self, bank: TemplateBank) -> None:
        self._shapes = BodyShapes(bank)
        self.reset()

    def reset(self) -> None:
        """Forget what was seen."""
        self._stamp_ns = 0
        self._regions: list[tuple[Box, float]] = []
        """What may be a body, in source pixels, and how sure that is by now."""

    def update(
        self,
        heat: HeatMap,
        source: tuple[int, int],
        occupied: Sequence[Box],
        least_height: float,
    ) -> list[Box]:
        """
        Take in a map, once, and return the boxes of people newly found, the tallest first.

        :param source: (H, W) of the frames.
        :param occupied: boxes of people known already, in source pixels.
        :param least_height: of anybody who is found, in source pixels.
        """
        if heat.stamp_ns == self._stamp_ns:
            return []
        self._stamp_ns = heat.stamp_ns
        before, self._regions = self._regions, []
        for box, evidence in self._bodies(heat.values, source, occupied, least_height):
            past = (known for other, known in before if other.iou(box) >= _SAME)
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
        least_height: float,
    ) -> list[tuple[Box, float]]:
        """Return the regions that may be a body, none of them a part of another one."""
        across, down = source[1] / values.shape[1], source[0] / values.shape[0]
        regions: list[tuple[float, Box]] = []
        for level in _LEVELS:
            # Not cv2.compare: that takes an image of one pixel for something else.
            above = cv2.inRange(values, level + 1, 255)
            _, labels, stats, _ = cv2.connectedComponentsWithStats(above)
            # The first are the pixels below the level.
            for number, (x, y, w, h, _) in enumerate(stats[1:].tolist(), 1):
                box = Box(x * across, y * down, w * across, h * down)
                if box.height < least_height or belongs(box, occupied):
                    continue
                region = cv2.inRange(labels[y : y + h, x : x + w], number, number)
                shape = normalised(region, box.width / box.height)
                likeness = 0.0 if shape is None else self._shapes.likeness(shape)
                regions.append((likeness, box))
        # Of a region and its parts the one that shows most of a body.
        regions.sort(key=lambda region: -region[0] * region[1].height ** 2)
        whole: list[tuple[float, Box]] = []
        for likeness, box in regions:
            if all(box.iou(other) == 0 for _, other in whole):
                whole.append((likeness, box))
        return [(box, likeness - _ALIKE) for likeness, box in whole if likeness > _ALIKE]
