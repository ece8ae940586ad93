# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Noticing that the masks have gone over to somebody else, or show somebody else, too.

Where two people cross, the masks may go over from one to the other; colours, outline and pace are
then learnt of the wrong one.  So what was known is kept for a while.  If somebody else was about,
and the body that is followed does not look any more as it did, in whatever light, then the person
is looked for where they would have gone, as what was known before says they look.  Where one mask
shows two people, look and place tell which of them is the person.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.colour import body_rows
from gait_segmentation.images import Window, bounding_box
from gait_segmentation.tracking.person.appearance import (
    SAME_COLOURS,
    colour_signature,
    likeness,
    likeness_in_any_light,
)
from gait_segmentation.tracking.person.person import Person, PersonSnapshot
from gait_segmentation.tracking.records import Record
from gait_segmentation.tracking.recovery.lost_and_found import LostAndFound, coasting
from gait_segmentation.tracking.recovery.parting import (
    Part,
    may_show_two,
    nearer,
    others_than,
    parts_of,
)
from gait_segmentation.tracking.recovery.silhouette import Silhouette

__all__ = ['Guard']

_EVERY, _KEPT = 5, 2
"""Masks from one time at which what is known is kept to the next, and how many such are kept."""

_LOOK_RATE = 0.4
"""Share by which the look that is kept moves towards that of a mask."""

_SURELY = 0.8
"""Similarity from which what a mask shows is kept although somebody is about."""

_LEAST, _MOST, _WIDEST = 0.8, 1.2, 0.75
"""
Area of a mask that is kept, over what is usual, and its greatest width in body heights: else part
of the person is hidden, or it shows somebody else, too.
"""

_OTHERS = 3
"""Masks in a row that must look otherwise."""

_ABOUT_S = 1.0
"""How long ago somebody must have been about."""

_FITS_BETTER = 0.05
"""By how much the person must fit better than anybody else whom a mask shows."""

_NEAR, _FAR_COST = 0.15, 0.5
"""
Distance in body heights from where the person would have gone that tells nothing, and what each
height more costs, in similarity of the look.
"""


@dataclass(frozen=True)
class _Known:
    """What was known of a person at some time."""

    look: NDArray[np.float32]
    person: PersonSnapshot
    silhouette: Silhouette


class Guard:
    """Watches whether somebody tracked is still the same."""

    def __init__(self) -> None:
        """Begin with somebody who was never looked at."""
        self._known: deque[_Known] = deque(maxlen=_KEPT)
        self._place = self._pace = (0.0, 0.0)
        self._since_s = 0.0
        self._in_doubt = False
        self._masks = 0
        self._others = 0
        self._about_ns: int | None = None

    @property
    def in_doubt(self) -> bool:
        """Return whether a mask since the last that was sure may have shown somebody else, too."""
        return self._in_doubt and bool(self._known)

    def carry(self, world: tuple[float, float], seconds: float) -> None:
        """
        Let the place at which the person was last seen for sure go on at the pace of then.

        :param world: shift of the still world at the person, in working pixels.
        :param seconds: since the frame before.
        """
        self._since_s += seconds
        seconds *= coasting(self._since_s)
        self._place = (
            self._place[0] + world[0] + seconds * self._pace[0],
            self._place[1] + world[1] + seconds * self._pace[1],
        )

    def found(self, person: Person) -> None:
        """Take note that somebody who was lost has been found."""
        self._place, self._since_s = (person.center_x, person.center_y), 0.0
        self._in_doubt = False
        self._masks = self._others = 0
        self._about_ns = None

    def is_other(
        self,
        person: Person,
        memory: LostAndFound,
        record: Record,
        window: Window,
        mask: NDArray[np.uint8],
        since: tuple[float, float],
        share: float,
        *,
        about: bool,
    ) -> bool:
        """
        Take in a mask, and return whether the last ones do not show the person of before.

        :param record: the frame of the mask.
        :param window: rows and columns about the person in it.
        :param mask: (H, W) uint8 0/255 of the working image.
        :param since: how far the person went since, in pixels.
        :param share: area of the mask over what is usual.
        :param about: whether somebody without a slot is near.
        """
        self._masks += 1
        due = self._masks % _EVERY == 1
        stamp_ns = record.image.stamp_ns
        if about:
            self._about_ns = stamp_ns
        watched = self._about_ns is not None and stamp_ns - self._about_ns <= _ABOUT_S * 1e9
        mask = mask[window]
        alike, look = 1.0, None
        if due or watched:
            lab = record.image.lab_part(window)
            rows = person.rows(window, since)
            look = colour_signature(lab, mask, rows)
        if watched and self._known and look is not None:
            before = self._known[0].look
            alike = max(likeness(before, look), memory.appearance.similarity(look))
            if alike < SAME_COLOURS:
                alike = max(alike, likeness_in_any_light(before, lab, mask, rows))
        self._others = self._others + 1 if alike < SAME_COLOURS else 0
        too_large = share > _MOST or bounding_box(mask)[2] >= _WIDEST * person.height
        self._in_doubt = self._in_doubt or too_large
        if alike >= _SURELY and share >= _LEAST and not too_large:
            self._place, self._pace = (person.center_x, person.center_y), memory.pace
            self._since_s, self._in_doubt = 0.0, False
            if due and look is not None:
                self._keep(person, memory, look)
        return self._others >= _OTHERS

    def _keep(self, person: Person, memory: LostAndFound, look: NDArray[np.float32]) -> None:
        if self._known:
            before = self._known[-1].look
            look = before + np.float32(_LOOK_RATE) * (look - before)
        self._known.append(_Known(look, person.snapshot(), memory.silhouette))

    def bring_back(self, person: Person, memory: LostAndFound) -> None:
        """Take up again what was known before, where the person would have gone since."""
        known = self._known[0]
        person.take_up(known.person, self._place)
        memory.take_up(known.look, self._pace, known.silhouette, self._since_s)

    def others_in(
        self,
        person: Person,
        memory: LostAndFound,
        record: Record,
        mask: NDArray[np.uint8],
        since: tuple[float, float],
    ) -> NDArray[np.uint8] | None:
        """
        Return what of a mask shows somebody else beside the person, None if nothing does.

        :param record: the frame of the mask.
        :param mask: (H, W) uint8 0/255 of the working image.
        :param since: how far the person went since, in pixels.
        :returns: (H, W) uint8 0/255.
        """
        bounds = bounding_box(mask)
        if not self._known or not may_show_two(bounds, person.height):
            return None
        x, y, width, tall = bounds
        window = slice(y, y + tall), slice(x, x + width)
        inside = np.ascontiguousarray(mask[window])
        parts = parts_of(inside, person.height)
        if len(parts) < 2:
            return None
        lab = record.image.lab_part(window)
        place = self._place[0] - since[0] - x, self._place[1] - since[1] - y
        fits = [self._fit(part, lab, place, person.height, memory) for part in parts]
        best = max(range(len(parts)), key=lambda index: fits[index])
        others = others_than(parts[best], parts, person.height)
        theirs = [fit for part, fit in zip(parts, fits, strict=True) if part in others]
        if not theirs or fits[best] < max(theirs) + _FITS_BETTER:
            return None
        out = np.zeros_like(mask)
        out[window] = nearer(inside, others, [part for part in parts if part not in others])
        return out

    def _fit(
        self,
        part: Part,
        lab: NDArray[np.uint8],
        place: tuple[float, float],
        height: float,
        memory: LostAndFound,
    ) -> float:
        """
        Return how well a part of a mask fits the person, at most 1.

        :param lab: (h, w, 3) uint8, the frame at the bounds of the mask.
        :param place: (x, y) where the person would have gone, from there.
        """
        left, top, width, tall = part.bounds
        alike = 0.0
        # Of who is seen in part it is not known which: from the head down, or as expected.
        for middle in (top + height / 2, place[1]):
            rows = body_rows(part.pixels.shape, (0, 0), (left + width / 2, middle), height)
            look = colour_signature(lab, part.pixels, rows)
            before = likeness(self._known[0].look, look)
            alike = max(alike, before, memory.appearance.similarity(look))
        off = math.hypot(part.center[0] - place[0], top + tall / 2 - place[1]) / height
        return alike - _FAR_COST * max(off - _NEAR, 0.0)
