# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
People without a slot who come near somebody tracked.

A colour never seen before is no colour of the background, and so it would be the tracked person's.
So who else is about is found and followed, and outline and colours are learnt before the two meet;
then both compete for pixels.  Outlines are only known in the windows about people, and at half of
the working size, which is a quarter of the work.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.ego_motion.world_motion import WorldMotion
from gait_segmentation.images import overlap
from gait_segmentation.tracking.competition import Claim
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.outline import Outline, halved
from gait_segmentation.tracking.person.person import Person, new_colours
from gait_segmentation.tracking.records import Record
from gait_segmentation.tracking.strangers.beside import Beside
from gait_segmentation.tracking.strangers.newcomers import Neighbour, newcomers
from gait_segmentation.tracking.strangers.passer_by import JOINED, PasserBy, meets

__all__ = ['PassersBy']

_COMPANY = 0.1
"""Gap to a tracked person, in body heights, up to which somebody may be in the way."""


class PassersBy:
    """All people without a slot who are near somebody tracked."""

    def __init__(self) -> None:
        """Begin with nobody."""
        self.known: list[PasserBy] = []
        self._next = -1

    @property
    def walking(self) -> bool:
        """Return whether somebody is near who is not known to stand still."""
        return any(not each.still for each in self.known)

    def are_about(self, person: Person, pending: Sequence[Record]) -> bool:
        """
        Return whether anybody may be in the way of a person, or what may be somebody.

        :param pending: frames not learnt yet.
        """
        gap = _COMPANY * person.height
        return any(meets(each.expected(pending), [person], gap) for each in self.known)

    def follow(
        self, motion: WorldMotion, last: Record, now: Record, pending: Sequence[Record]
    ) -> None:
        """
        Follow everybody into the newest frame.

        :param motion: of the world.
        :param last: the frame before.
        :param now: the newest frame, in which the shifts are noted.
        :param pending: frames not learnt yet.
        """
        for each in self.known:
            each.follow(motion, last, now, each.expected(pending))

    def claims(
        self,
        now: Record,
        pending: Sequence[Record],
        people: Sequence[Person],
        config: TrackingConfig,
    ) -> dict[int, Claim]:
        """
        Judge the pixels about everybody near, who thus compete with those who are tracked.

        :param now: the newest frame.
        :param pending: frames not learnt yet.
        :param people: who is tracked.
        :returns: the claims by number.
        """
        made = {
            each.number: each.claim(now, each.expected(pending), people, config)
            for each in self.known
        }
        return {number: claim for number, claim in made.items() if claim is not None}

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
        known = {each.number: each for each in self.known}
        for (number, claim), logit in zip(claims.items(), logits, strict=True):
            now.passers_by[number] = known[number].won(now, claim, logit, shadow_floor)

    def skip(self, record: Record) -> None:
        """Let go of a frame that is never learnt: only its motion counts."""
        for each in self.known:
            each.outline = each.expected([record])

    def leave(self, where: NDArray[np.uint8]) -> None:
        """
        Forget those who got a slot.

        :param where: (h, w) uint8, non-zero on people new in the last frame.
        """
        if not self.known:
            return
        height, width = where.shape
        half = np.ascontiguousarray(where[: height // 2 * 2 : 2, : width // 2 * 2 : 2])
        self.known = [
            each for each in self.known if 2 * _common(each.outline, half) < each.outline.area
        ]

    def welcome(
        self,
        mask: NDArray[np.uint8],
        shift: tuple[float, float],
        record: Record,
        person: Person,
        config: TrackingConfig,
    ) -> None:
        """
        Take in somebody whom a mask of a tracked person showed, unless it is somebody known.

        :param mask: (H, W) uint8 of a frame.
        :param shift: of the tracked person since, in pixels, who went the same way.
        """
        height, width = mask.shape
        half = np.ascontiguousarray(mask[: height // 2 * 2 : 2, : width // 2 * 2 : 2])
        outline = Outline.of(half)
        for each in self.known:
            if 2 * _common(each.outline, half) > outline.area:
                each.not_track = person.track_id
                return
        self._add(outline, record, person, config)
        new = self.known[-1]
        new.outline = outline.shifted(*shift)
        new.velocity, new.proven = person.velocity, True
        new.not_track = person.track_id

    def who_is_not(
        self, track_id: int, pending: Sequence[Record], shape: tuple[int, int]
    ) -> NDArray[np.uint8] | None:
        """
        Return where those are who cannot be the person of a track, None if there are none.

        :param pending: frames not learnt yet.
        :param shape: (h, w) of the working image.
        :returns: (h, w) uint8, non-zero on them.
        """
        others = [each for each in self.known if each.not_track == track_id]
        if not others:
            return None
        out = np.zeros(shape, np.uint8)
        for each in others:
            out |= each.expected(pending).enlarged((slice(0, shape[0]), slice(0, shape[1])))
        return out

    def forget(self) -> None:
        """Forget everybody."""
        self.known = []

    def learn(self, beside: Beside, pending: Sequence[Record], people: Sequence[Person]) -> None:
        """
        Learn outlines and colours of a frame; who is in no window about people is gone.

        :param pending: the frames since.
        :param people: who is tracked.
        """
        if not self.known:
            return
        height, width = beside.shape
        windows = [halved(person.window((2 * height, 2 * width))) for person in people]
        self.known = [
            each
            for each in self.known
            if each.learn(beside, pending)
            and any(overlap(each.outline.window, window) for window in windows)
        ]

    def find(self, beside: Beside, neighbour: Neighbour, config: TrackingConfig) -> None:
        """Look for somebody new about a person."""
        known = [(each.outline, JOINED * each.height / 2) for each in self.known]
        for outline in newcomers(beside, neighbour, known):
            self._add(outline, beside.record, neighbour.person, config)

    def _add(
        self, outline: Outline, record: Record, person: Person, config: TrackingConfig
    ) -> None:
        number, self._next = self._next, self._next - 1
        new = PasserBy(
            number,
            person.center_x,
            person.center_y,
            person.height,
            outline,
            new_colours(config)[0],
            record.image.stamp_ns,
            usual_area=float(outline.area),
        )
        new.learn_colours(record, (), outline)
        self.known.append(new)


def _common(outline: Outline, where: NDArray[np.uint8]) -> int:
    """Return how much of an outline lies on what is not zero in an image at half size."""
    window = outline.about(0, (where.shape[0], where.shape[1]))
    part = outline.seen_in(window)
    return int(cv2.countNonZero(cv2.bitwise_and(part, where[window]))) if part.size else 0
