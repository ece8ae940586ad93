# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Somebody without a slot who comes near somebody tracked: followed, judged, learnt."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.colour import ColourModel, body_rows, colour_bins
from gait_segmentation.ego_motion.world_motion import WorldMotion
from gait_segmentation.images import Window, overlap, size_of
from gait_segmentation.tracking.background.kernels import SURE_COUNT
from gait_segmentation.tracking.competition import Claim
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.likelihood.log_ratio import log_ratio
from gait_segmentation.tracking.nearness import REACH, Nearness, nearness
from gait_segmentation.tracking.outline import Outline, doubled, every, halved, lab_of
from gait_segmentation.tracking.person.person import Person
from gait_segmentation.tracking.records import Record, body_over
from gait_segmentation.tracking.strangers.beside import Beside
from gait_segmentation.tracking.strangers.block_matching import matched_shift
from gait_segmentation.tracking.strangers.newcomers import APART

__all__ = ['JOINED', 'PasserBy', 'meets']

JOINED = 0.1
"""Distance from somebody known up to which what else is strange belongs to them, in heights."""

_CLEAR = 0.2
"""
Distance from the template of who is tracked, in body heights, from which what is strange is learnt
of somebody else beyond what they won.
"""

_GROWTH = 0.05
"""How far from the outline somebody is seen, in body heights."""

_WHOLE = 0.7
"""Share of the usual area from which outline and shift are learnt."""

_SEEN = 0.1
"""
Share of the usual area that must be seen apart from who is tracked: what only shows in their place
is a part of them that was taken for somebody else.
"""

_MOSTLY = 0.5
"""Share that must be clear of who is tracked for colours to be learnt."""

_COLOUR_RATE = 0.15

_PATIENCE_S = 1.0
"""How long somebody is waited for who is not seen apart."""

_FASTEST, _SLOWER = 0.2, 0.1
"""How far somebody new may go from frame to frame, and how far off the pace later, in heights."""

_PROBATION_S, _DOUBT_S, _LEAST_WAY = 0.2, 0.6, 0.04
"""
How far in body heights somebody must have gone in a time to be somebody, when well seen and at
all: leaves and grass that stir, and things nearer than the background, stay where they are.
"""

_MEETING = 0.25
"""Gap to a tracked person from which both compete for pixels, in body heights."""

_VELOCITY_RATE = 0.3
_AREA_RATE = 0.1


@dataclass
class PasserBy:
    """
    Somebody without a slot, in working pixels.

    ``number`` is negative, beside the track ids in the records.  ``center_x``, ``center_y`` and
    ``height`` are those of the tracked person at the time both came near, moved along since: the
    frame in which the colours are told apart by height.  ``outline`` is that of the last frame
    learnt, as far as it lies in the windows about people, and ``usual_area`` its area, in pixels
    of half the size; ``velocity`` and ``way``, which was gone so far, are relative to the still
    world.  Who has gone far enough is ``proven`` and competes; what does not go is ``still``: it
    is nobody, and only kept so that it is not found again.  ``not_track`` is the track id, if any,
    of a person whose mask showed this one, too, who thus cannot be that person.
    """

    number: int
    center_x: float
    center_y: float
    height: float
    outline: Outline
    colours: ColourModel
    seen_ns: int
    velocity: tuple[float, float] = (0.0, 0.0)
    usual_area: float = 0.0
    well_seen: bool = True
    followed: bool = False
    known_s: float = 0.0
    watched_s: float = 0.0
    proven: bool = False
    way: tuple[float, float] = (0.0, 0.0)
    still: bool = False
    not_track: int = 0

    def expected(self, pending: Sequence[Record]) -> Outline:
        """Return the outline, carried along through frames not learnt yet."""
        return self.outline.shifted(*body_over(pending, self.number))

    def follow(self, motion: WorldMotion, last: Record, now: Record, outline: Outline) -> None:
        """
        Follow the person into the newest frame.

        :param motion: of the world.
        :param last: the frame before.
        :param now: the newest frame, in which the shift is noted.
        :param outline: in the frame before.
        """
        x, y = motion.carry(self.center_x, self.center_y)
        world = (x - self.center_x, y - self.center_y)
        shift = (world[0] + self.velocity[0], world[1] + self.velocity[1])
        if self.still:
            shift = world
        elif self.well_seen:
            reach = (_SLOWER if self.followed else _FASTEST) * self.height
            shift = matched_shift(last.image.pyramid, now.image.pyramid, outline, shift, reach)
            gain = _VELOCITY_RATE if self.followed else 1.0
            self.velocity = (
                self.velocity[0] + gain * (shift[0] - world[0] - self.velocity[0]),
                self.velocity[1] + gain * (shift[1] - world[1] - self.velocity[1]),
            )
            self.followed = True
        self.way = self.way[0] + shift[0] - world[0], self.way[1] + shift[1] - world[1]
        if not (self.proven or self.still):
            step_s = (now.image.stamp_ns - last.image.stamp_ns) / 1e9
            self.known_s += step_s
            self.watched_s += step_s if self.well_seen else 0.0
            self.proven = math.hypot(*self.way) >= _LEAST_WAY * self.height
            over = self.watched_s >= _PROBATION_S or self.known_s >= _DOUBT_S
            self.still = over and not self.proven
        self.center_x += shift[0]
        self.center_y += shift[1]
        now.bodies[self.number] = shift

    def claim(
        self, now: Record, outline: Outline, people: Sequence[Person], config: TrackingConfig
    ) -> Claim | None:
        """
        Judge the pixels where the person may meet somebody tracked, None if there are none.

        :param now: the newest frame.
        :param outline: as expected in it.
        :param people: who is tracked; what surrounds the nearest is what surrounds a passer-by.
        """
        if not (self.proven and outline.inside.size):
            return None
        shape = (now.image.gray.shape[0], now.image.gray.shape[1])
        half = (shape[0] // 2, shape[1] // 2)
        room = _shared(outline.about(REACH * self.height / 2, half), people, shape)
        if room is None or not meets(outline, people, _MEETING * self.height):
            return None
        window = doubled(room)
        lab = now.image.lab_part(window)
        nearest = min(people, key=lambda person: abs(person.center_x - self.center_x))
        logit = log_ratio(
            lab,
            colour_bins(lab),
            self._rows(window),
            window,
            now.background,
            self.colours,
            nearest.surroundings,
            config,
        )
        near = _nearness(outline.seen_in(room), self.height)
        mask = np.zeros(logit.shape, np.uint8)
        return Claim(window, logit, mask, near, 0.0, self.height, known=False)

    def won(
        self, now: Record, claim: Claim, logit: NDArray[np.float32], shadow_floor: float
    ) -> Outline:
        """
        Return what the person got of a claim that is not the known background.

        :param logit: (h, w) float32 of the window of the claim, after the competition.
        :param shadow_floor: darkest shadow, as a share of the lightness of the background.
        """
        top, left = (side.start // 2 for side in claim.window)
        if claim.near is None:
            return Outline(top, left, np.empty((0, 0), np.uint8))
        rows, columns = claim.near.part
        likely = logit[rows, columns][::2, ::2] > 0
        likely &= claim.near.distance[::2, ::2] > -_GROWTH * self.height
        top, left = top + rows.start // 2, left + columns.start // 2
        part = (slice(top, top + likely.shape[0]), slice(left, left + likely.shape[1]))
        other = now.strange(every(part), shadow_floor, lab_of(now.image, part)) > 0
        likely &= other | (now.background.count[every(part)] < SURE_COUNT)
        return Outline(top, left, np.uint8(255) * likely.view(np.uint8))

    def learn(self, beside: Beside, pending: Sequence[Record]) -> bool:
        """
        Learn outline and colours of a frame; return whether the place is still worth watching.

        :param pending: the frames since.
        """
        record = beside.record
        shift = record.bodies.get(self.number)
        if shift is None:
            return True
        self.outline = self.outline.shifted(*shift)
        if self.still:
            return True
        window = self.outline.about(JOINED * self.height / 2, beside.shape)
        seen, clear = self._seen(beside, window)
        area = cv2.countNonZero(seen)
        stamp_ns = record.image.stamp_ns
        if self._seen_apart(beside, window, seen) >= _SEEN * self.usual_area:
            self.seen_ns = stamp_ns
        self.well_seen = area >= _WHOLE * self.usual_area
        if self.well_seen:
            self.usual_area += _AREA_RATE * (area - self.usual_area)
            self.usual_area = max(self.usual_area, float(area))
            self.outline = Outline.of(seen, window[0].start, window[1].start)
            seen &= clear
            if cv2.countNonZero(seen) > _MOSTLY * area:
                clear_part = Outline.of(seen, window[0].start, window[1].start)
                self.learn_colours(record, pending, clear_part)
        return stamp_ns - self.seen_ns < _PATIENCE_S * 1e9 and self.outline.inside.size > 0

    def _seen(self, beside: Beside, window: Window) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """Return what is seen in a window, and what of it is clear of who is tracked, 0/255."""
        inside = self.outline.seen_in(window)
        if not inside.any():
            return inside, inside
        clear = beside.far(window, _CLEAR * self.height / 2)
        margin = max(1, round(JOINED * self.height / 2))
        seen = cv2.dilate(inside, np.ones((2 * margin + 1, 2 * margin + 1), np.uint8))
        seen &= beside.strange[window]
        seen &= clear
        if self.number in beside.record.passers_by:
            seen |= beside.record.passers_by[self.number].seen_in(window)
        seen &= cv2.bitwise_not(beside.masks[window])
        return np.asarray(seen), clear

    def _seen_apart(self, beside: Beside, window: Window, seen: NDArray[np.uint8]) -> int:
        """Return how many pixels of what is seen in a window are no part of who is tracked."""
        if not seen.any():
            return 0
        return cv2.countNonZero(seen & beside.far(window, APART * self.height / 2))

    def learn_colours(self, record: Record, pending: Sequence[Record], of: Outline) -> None:
        """
        Learn the colours in an outline of a frame.

        :param pending: the frames since.
        """
        bins = colour_bins(lab_of(record.image, of.window))
        rows = self._rows(doubled(of.window), body_over(pending, self.number))
        rows = np.ascontiguousarray(rows[::2, ::2])
        self.colours.learn(bins, rows, of.inside > 0, _COLOUR_RATE)

    def _rows(
        self, window: Window, shift: tuple[float, float] = (0.0, 0.0)
    ) -> NDArray[np.float32]:
        """Return how far down the body each pixel lies, moved back by a shift."""
        center = (self.center_x - shift[0], self.center_y - shift[1])
        return body_rows(size_of(window), (window[1].start, window[0].start), center, self.height)


def _shared(window: Window, people: Sequence[Person], shape: tuple[int, int]) -> Window | None:
    """Return the part at half size of a window that lies in those about people."""
    parts = [overlap(window, halved(person.window(shape))) for person in people]
    found = [part for part in parts if part is not None]
    if not found:
        return None
    rows, columns = (
        slice(min(part[axis].start for part in found), max(part[axis].stop for part in found))
        for axis in (0, 1)
    )
    return rows, columns


def meets(outline: Outline, people: Sequence[Person], gap: float) -> bool:
    """Return whether somebody comes near a box about a person, up to a gap in pixels."""
    rows, columns = doubled(outline.window)
    return any(
        columns.start - gap < area.right
        and area.x < columns.stop + gap
        and rows.start - gap < area.bottom
        and area.y < rows.stop + gap
        for area in (person.area for person in people)
    )


def _nearness(mask: NDArray[np.uint8], height: float) -> Nearness | None:
    """Return how near the pixels of a window are to a mask at half its size."""
    near = nearness(mask, height / 2)
    if near is None:
        return None
    rows, columns = doubled(near.part)
    size = (columns.stop - columns.start, rows.stop - rows.start)
    distance = cv2.resize(near.distance, size, interpolation=cv2.INTER_LINEAR)
    return Nearness((rows, columns), np.asarray(np.multiply(distance, np.float32(2))))
