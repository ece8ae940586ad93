# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
People without a slot who come near somebody tracked.

A colour never seen before is no colour of the background, and so it would be the tracked person's.
What is large, is not the known background and stands apart from the person is somebody else:
outline and colours are learnt before the two meet, and then both compete for pixels.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.colour import ColourModel, body_rows, colour_bins
from gait_segmentation.ego_motion.estimator import Motion
from gait_segmentation.ego_motion.pyramid import Pyramid
from gait_segmentation.geometry import Box
from gait_segmentation.images import Window, bounding_box, shift_whole
from gait_segmentation.tracking.appearance import Appearance, colour_signature
from gait_segmentation.tracking.background_kernels import SURE_COUNT
from gait_segmentation.tracking.competition import Claim
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.likelihood import log_ratio
from gait_segmentation.tracking.nearness import REACH, nearness
from gait_segmentation.tracking.person import Person, new_colours
from gait_segmentation.tracking.records import Record, body_over

__all__ = ['PasserBy', 'PassersBy', 'about_template']

_LEAST_HEIGHT, _LEAST_AREA = 0.35, 0.015
"""Height and area of what is somebody else, in body heights of the person near."""

_APART, _ASIDE = 0.08, 0.25
"""
Distance of all of it from the template, and of its middle from the person's axis, in body heights:
an arm or a bag that was missed is nearer.
"""

_GAP = 0.04
"""Least gap to a tracked person and what is about the template, in body heights."""

_ALIKE = 0.5
"""Similarity of colours from which something may be the tracked person."""

_BRIDGED = 0.02
"""Gaps up to this, in body heights, do not part what is somebody else."""

_JOINED, _CLEAR = 0.1, 0.2
"""
Distance from somebody known up to which what else is strange belongs to them, if it is that far
from the template of who is tracked; colours are learnt there only, too. In body heights.
"""

_GROWTH = 0.05
"""How far from the outline somebody is seen, in body heights."""

_WHOLE, _SEEN = 0.7, 0.1
"""
Share of the usual area from which outline and shift are learnt, and from which there is anybody.
"""

_MOSTLY = 0.5
"""Share that must be clear of who is tracked for colours to be learnt."""

_PATIENCE_S = 1.0
"""How long somebody hidden is waited for."""

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
    frame in which the colours are told apart by height.  ``mask`` is (h, w) uint8 of the last
    frame learnt, ``velocity`` and ``way``, which was gone so far, are relative to the still world.
    What does not go is ``still``: it is nobody, and only kept so that it is not found again.
    """

    number: int
    center_x: float
    center_y: float
    height: float
    mask: NDArray[np.uint8]
    colours: ColourModel
    velocity: tuple[float, float] = (0.0, 0.0)
    usual_area: float = 0.0
    well_seen: bool = True
    followed: bool = False
    seen_ns: int = 0
    known_s: float = 0.0
    watched_s: float = 0.0
    proven: bool = False
    way: tuple[float, float] = (0.0, 0.0)
    still: bool = False

    def rows(self, window: Window, shift: tuple[float, float]) -> NDArray[np.float32]:
        """Return how far down the body each pixel lies, moved back by a shift."""
        shape = (window[0].stop - window[0].start, window[1].stop - window[1].start)
        center = (self.center_x - shift[0], self.center_y - shift[1])
        return body_rows(shape, (window[1].start, window[0].start), center, self.height)


class PassersBy:
    """All people without a slot who are near somebody tracked."""

    def __init__(self) -> None:
        """Begin with nobody."""
        self.known: list[PasserBy] = []
        self._next = -1

    def follow(
        self, motion: Motion, last: Record, now: Record, masks: Sequence[NDArray[np.uint8]]
    ) -> None:
        """
        Follow everybody into the newest frame.

        :param motion: of the camera.
        :param last: the frame before.
        :param now: the newest frame, in which the shifts are noted.
        :param masks: the outlines in the frame before.
        """
        for each, mask in zip(self.known, masks, strict=True):
            x, y = motion.carry(each.center_x, each.center_y)
            world = (x - each.center_x, y - each.center_y)
            shift = (world[0] + each.velocity[0], world[1] + each.velocity[1])
            if each.still:
                shift = world
            elif each.well_seen:
                reach = (_SLOWER if each.followed else _FASTEST) * each.height
                shift = _matched(last.image.pyramid, now.image.pyramid, mask, shift, reach)
                gain = _VELOCITY_RATE if each.followed else 1.0
                each.velocity = (
                    each.velocity[0] + gain * (shift[0] - world[0] - each.velocity[0]),
                    each.velocity[1] + gain * (shift[1] - world[1] - each.velocity[1]),
                )
                each.followed = True
            each.way = each.way[0] + shift[0] - world[0], each.way[1] + shift[1] - world[1]
            if not each.proven:
                step_s = (now.image.stamp_ns - last.image.stamp_ns) / 1e9
                each.known_s += step_s
                each.watched_s += step_s if each.well_seen else 0.0
                each.proven = math.hypot(*each.way) >= _LEAST_WAY * each.height
                over = each.watched_s >= _PROBATION_S or each.known_s >= _DOUBT_S
                each.still = over and not each.proven
            each.center_x += shift[0]
            each.center_y += shift[1]
            now.bodies[each.number] = shift

    def masks(self, pending: Sequence[Record]) -> list[NDArray[np.uint8]]:
        """Return the outlines, carried along through frames not learnt yet."""
        carried = []
        for each in self.known:
            dx, dy = body_over(pending, each.number)
            carried.append(shift_whole(each.mask, round(dx), round(dy)))
        return carried

    def claims(
        self,
        now: Record,
        masks: Sequence[NDArray[np.uint8]],
        people: Sequence[Person],
        config: TrackingConfig,
    ) -> dict[int, Claim]:
        """
        Judge the pixels about everybody near, who thus compete with those who are tracked.

        :param masks: the outlines in the newest frame.
        :param people: who is tracked; what surrounds the nearest is what surrounds a passer-by.
        :returns: the claims by number.
        """
        claims: dict[int, Claim] = {}
        for each, mask in zip(self.known, masks, strict=True):
            if each.still or not _meets(mask, people, _MEETING * each.height):
                continue
            window = _about(mask, REACH * each.height)
            lab = now.image.lab_part(window)
            nearest = min(people, key=lambda person: abs(person.center_x - each.center_x))
            logit = log_ratio(
                lab,
                colour_bins(lab),
                each.rows(window, (0.0, 0.0)),
                window,
                now.background,
                each.colours,
                nearest.surroundings,
                config,
            )
            near = nearness(np.ascontiguousarray(mask[window]), each.height)
            claims[each.number] = Claim(window, logit, mask, near, 0.0, each.height, known=False)
        return claims

    def note(
        self,
        now: Record,
        claims: Mapping[int, Claim],
        logits: Sequence[NDArray[np.float32]],
        shadow_floor: float,
    ) -> None:
        """
        Note in the newest frame what everybody got that is not the known background.

        :param logits: of the claims, in their order.
        :param shadow_floor: darkest shadow, as a share of the lightness of the background.
        """
        heights = {each.number: each.height for each in self.known}
        for (number, claim), logit in zip(claims.items(), logits, strict=True):
            seen = np.zeros(claim.mask.shape, np.uint8)
            if claim.near is not None:
                likely = logit[claim.near.part] > 0
                likely &= claim.near.distance > -_GROWTH * heights[number]
                window = _within(claim.window, claim.near.part)
                other = now.strange(window, shadow_floor) > 0
                likely &= other | (now.background.count[window] < SURE_COUNT)
                seen[window] = 255 * likely.view(np.uint8)
            now.passers_by[number] = seen

    def skip(self, record: Record) -> None:
        """Let go of a frame that is never learnt: only its motion counts."""
        for each in self.known:
            if each.number in record.bodies:
                dx, dy = record.bodies[each.number]
                each.mask = shift_whole(each.mask, round(dx), round(dy))

    def leave(self, where: NDArray[np.uint8]) -> None:
        """Forget those who got a slot, (h, w) uint8, non-zero on people new in the last frame."""
        self.known = [
            each
            for each in self.known
            if 2 * cv2.countNonZero(cv2.bitwise_and(each.mask, where))
            < cv2.countNonZero(each.mask)
        ]

    def learn(
        self,
        record: Record,
        pending: Sequence[Record],
        strange: NDArray[np.uint8],
        people: NDArray[np.uint8],
        templates: NDArray[np.uint8],
        windows: Sequence[Window],
    ) -> None:
        """
        Learn outlines and colours of a frame.

        :param pending: the frames since.
        :param strange: (h, w) uint8, non-zero on what is not the known background.
        :param people: (h, w) uint8, non-zero where people are who are tracked.
        :param templates: (h, w) uint8, above 127 on their templates.
        :param windows: rows and columns about them; who is in none is gone.
        """
        self.known = [
            each
            for each in self.known
            if self._learn(each, record, pending, strange, people, templates)
            and any(each.mask[window].any() for window in windows)
        ]

    def _learn(
        self,
        each: PasserBy,
        record: Record,
        pending: Sequence[Record],
        strange: NDArray[np.uint8],
        people: NDArray[np.uint8],
        templates: NDArray[np.uint8],
    ) -> bool:
        """Learn somebody; return whether the place is still worth watching."""
        shift = record.bodies.get(each.number)
        if shift is not None:
            each.mask = shift_whole(each.mask, round(shift[0]), round(shift[1]))
        if shift is None or each.still:
            return True
        clear = cv2.bitwise_not(about_template(templates, _CLEAR * each.height))
        joined = cv2.bitwise_and(_grown(each.mask, _JOINED * each.height), clear)
        seen = cv2.bitwise_and(strange, joined)
        if each.number in record.passers_by:
            seen = cv2.bitwise_or(seen, record.passers_by[each.number])
        seen = cv2.bitwise_and(seen, cv2.bitwise_not(people))
        area = cv2.countNonZero(seen)
        stamp_ns = record.image.stamp_ns
        if area >= _SEEN * each.usual_area:
            each.seen_ns = stamp_ns
        each.well_seen = area >= _WHOLE * each.usual_area
        if each.well_seen:
            each.usual_area += _AREA_RATE * (area - each.usual_area)
            each.usual_area = max(each.usual_area, float(area))
            each.mask = seen
            clear = cv2.bitwise_and(seen, clear)
            if cv2.countNonZero(clear) > _MOSTLY * area:
                self._learn_colours(each, record, pending, clear)
        return stamp_ns - each.seen_ns < _PATIENCE_S * 1e9 and bool(each.mask.any())

    @staticmethod
    def _learn_colours(
        each: PasserBy, record: Record, pending: Sequence[Record], mask: NDArray[np.uint8]
    ) -> None:
        window = _about(mask, 0)
        if window[0].start == window[0].stop:
            return
        lab = record.image.lab_part(window)
        rows = each.rows(window, body_over(pending, each.number))
        each.colours.learn(colour_bins(lab), rows, mask[window] > 0, 0.15)

    def find(
        self,
        record: Record,
        window: Window,
        strange: NDArray[np.uint8],
        people: NDArray[np.uint8],
        templates: NDArray[np.uint8],
        person: Person,
        appearance: Appearance,
        config: TrackingConfig,
        *,
        whole: bool,
        inside: bool,
    ) -> None:
        """
        Look for somebody new about a person.

        :param window: the rows and columns about the person.
        :param strange: (h, w) uint8 of the image, non-zero on what is not the known background.
        :param people: (h, w) uint8, non-zero on and about people who are tracked.
        :param templates: (h, w) uint8, above 127 on their templates.
        :param appearance: what the person looks like.
        :param whole: whether as much of the person is seen as usual: else what touches or
            looks like the person may be another part, as beyond a pole.
        :param inside: whether the person is in the image: else what touches may be another part.
        """
        height = person.height
        beside = strange[window] & ~people[window]
        if cv2.countNonZero(beside) < _LEAST_AREA * height**2:
            return
        about = about_template(templates[window], _APART * height)
        # What is seen of somebody seen in part may go on.
        taken = _grown(people[window] | about, _GAP * height)
        if whole and inside:
            beside &= ~about
        for each in self.known:
            beside &= ~_grown(each.mask, _JOINED * each.height)[window]
        if cv2.countNonZero(beside) < _LEAST_AREA * height**2:
            return
        size = 2 * max(1, round(_BRIDGED * height)) + 1
        beside = cv2.morphologyEx(beside, cv2.MORPH_CLOSE, np.ones((size, size), np.uint8))
        beside = cv2.morphologyEx(beside, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
        found: list[tuple[slice, PasserBy]] = []
        count, parts, stats, centers = cv2.connectedComponentsWithStats(beside, connectivity=4)
        for part in range(1, count):
            aside = abs(centers[part][0] + window[1].start - person.center_x)
            if (
                stats[part, cv2.CC_STAT_HEIGHT] < _LEAST_HEIGHT * height
                or stats[part, cv2.CC_STAT_AREA] < _LEAST_AREA * height**2
                or aside < _ASIDE * height
                or (not (whole and inside) and taken[parts == part].any())
                or (not whole and self._alike(record, window, parts == part, person, appearance))
            ):
                continue
            left, width = stats[part, cv2.CC_STAT_LEFT], stats[part, cv2.CC_STAT_WIDTH]
            for columns, other in found:
                if left < columns.stop and left + width > columns.start:
                    # Parts above each other are of one person.
                    other.mask[window][parts == part] = 255
                    break
            else:
                mask = np.zeros(strange.shape, np.uint8)
                mask[window][parts == part] = 255
                found.append((slice(left, left + width), self._new(mask, record, person, config)))
        for _, new in found:
            new.usual_area = float(cv2.countNonZero(new.mask))
            self._learn_colours(new, record, (), new.mask)
            self.known.append(new)

    @staticmethod
    def _alike(
        record: Record,
        window: Window,
        part: NDArray[np.bool_],
        person: Person,
        appearance: Appearance,
    ) -> bool:
        """Return whether something looks like the person, as beyond a pole it would."""
        lab = record.image.lab_part(window)
        inside = np.uint8(255) * part.view(np.uint8)
        likeness = appearance.similarity(colour_signature(lab, inside, person.rows(window)))
        return likeness >= _ALIKE

    def _new(
        self, mask: NDArray[np.uint8], record: Record, person: Person, config: TrackingConfig
    ) -> PasserBy:
        number, self._next = self._next, self._next - 1
        return PasserBy(
            number,
            person.center_x,
            person.center_y,
            person.height,
            mask,
            new_colours(config)[0],
            seen_ns=record.image.stamp_ns,
        )


def _meets(mask: NDArray[np.uint8], people: Sequence[Person], gap: float) -> bool:
    """Return whether a mask comes near somebody's box, up to a gap in pixels."""
    box = Box.around(mask)
    if box is None:
        return False
    box = box.padded(gap, gap)
    return any(
        box.x < one.right and one.x < box.right and box.y < one.bottom and one.y < box.bottom
        for one in (person.area for person in people)
    )


def _matched(
    last: Pyramid,
    now: Pyramid,
    mask: NDArray[np.uint8],
    guess: tuple[float, float],
    reach: float,
) -> tuple[float, float]:
    """Return the shift that makes what is in a mask look most alike in two frames."""
    before, after = last.image(1), now.image(1)
    half = np.ascontiguousarray(mask[::2, ::2][: before.shape[0], : before.shape[1]])
    rows, columns = _about(half, 0)
    if rows.start == rows.stop:
        return guess
    x, y, side = round(guess[0] / 2), round(guess[1] / 2), max(1, round(reach / 2))
    margin = side + max(abs(x), abs(y))
    room = cv2.copyMakeBorder(after, margin, margin, margin, margin, cv2.BORDER_REPLICATE)
    top, left = rows.start + margin + y - side, columns.start + margin + x - side
    room = room[
        top : top + rows.stop - rows.start + 2 * side,
        left : left + columns.stop - columns.start + 2 * side,
    ]
    part = (rows, columns)
    unlike = cv2.matchTemplate(room, before[part], cv2.TM_SQDIFF, mask=half[part])
    row, column = np.unravel_index(int(unlike.argmin()), unlike.shape)
    return 2.0 * (x + int(column) - side), 2.0 * (y + int(row) - side)


def _within(window: Window, part: Window) -> Window:
    """Return the rows and columns in the image of a part of a window."""
    (top, left), (rows, columns) = (each.start for each in window), part
    return (
        slice(top + rows.start, top + rows.stop),
        slice(left + columns.start, left + columns.stop),
    )


def about_template(template: NDArray[np.uint8], margin: float) -> NDArray[np.uint8]:
    """Return the template with a margin in pixels, (h, w) uint8 0/255."""
    inside = cv2.threshold(template, 127, 255, cv2.THRESH_BINARY)[1]
    return _grown(np.asarray(inside), margin)


def _about(mask: NDArray[np.uint8], margin: float) -> Window:
    """Return the rows and columns about what is not zero in an image."""
    x, y, width, height = bounding_box(mask)
    if width == 0:
        return slice(0, 0), slice(0, 0)
    reach = int(margin) + 2 if margin else 0
    return (
        slice(max(y - reach, 0), min(y + height + reach, mask.shape[0])),
        slice(max(x - reach, 0), min(x + width + reach, mask.shape[1])),
    )


def _grown(mask: NDArray[np.uint8], margin: float) -> NDArray[np.uint8]:
    """Return a mask with a margin in pixels."""
    out = np.zeros_like(mask)
    window = _about(mask, margin)
    if window[0].start == window[0].stop:
        return out
    size = 2 * max(1, round(margin)) + 1
    out[window] = cv2.dilate(mask[window], np.ones((size, size), np.uint8))
    return out
