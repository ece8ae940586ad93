# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Whether what is tracked is a person: one number, the log-odds, which nothing else decides over.

It is a sum, as in the literature on track existence (Musicki, Evans and Stankovic, Integrated
Probabilistic Data Association, IEEE Transactions on Automatic Control, 1994): what the looks of
a detector say that see them, and those that do not, what a network says that draws them, whether
they move against the world, and whether what rests looks as it did while it moved.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

CERTAIN = math.log(200)
"""Most log-odds of a person: what a silence by chance is less likely than when nobody is there."""

_SCORES = (0.15, 0.3, 0.5, 0.55, 0.6, 0.7, 0.8, 0.95)
_SMALL = (-3.5, -2.0, -0.4, 2.2, 2.6, 3.5, 5.0, 10.0)
_TALL = (-6.0, -4.0, -1.5, -0.75, 0.0, 2.0, 5.0, 10.0)
"""
Scores of a detector, and what they say of somebody small and tall: of the latter all but a few
have .7 and more, of the former .4 to .7, and of things that are no people .5 at most.
"""

_PRESENCES = (-12.0, -6.0, -2.0, 0.0, 3.0)
_SMALL_PRESENT = (-6.0, -2.0, -0.5, 0.3, 2.5)
_TALL_PRESENT = (-6.0, -6.0, -6.0, -4.0, 2.5)
"""
Log-odds of a person in the square that a network draws, and what they say of somebody small and
tall: those of people are above 1, of others mostly far below 0; one in a hundred of the tall is
below 0, and a third of the small.
"""

_SMALL_SHARE, _TALL_SHARE = 0.14, 0.235
"""Heights up to which somebody is small, and from which tall, in longer sides of the image."""

_AGAIN = 0.4
"""What a second look adds."""

_MOVED, _MOST_MOVING = 2.0, 0.2
"""
What it adds that it moves, and the share of its pixels that then do: before a thing leaves and
noise move fewer.
"""

_RESTS, _RESTS_NS = -2.5, 1_000_000_000
"""
What it adds that no pixel has moved since it was found, and no network draws a person there, and
after which time.
"""

_STILL, _STILL_NS = -4.0, 4_000_000_000
"""
What it adds at last that no pixel has moved for so much longer, whatever a network draws: people
sway, and of what hardly looks like a person a network draws one, too.
"""

_TRIAL_NS = 5_000_000_000
"""Time for which what has not moved since it was found is followed, whatever it looks like."""

_UNLIKE = -6.0
"""What it adds that what rests looks otherwise than it did while it moved."""

_SURE = 1.5
"""What looks say of somebody, in the mean, who is there whatever it looks like."""

_ASKED_NS = 300_000_000
"""Time without motion after which it is asked what rests there: people sway, things do not."""

_LATEST = 5
"""Looks over which the mean is taken of what they say, at most."""

_ABSENT_RATE = 1 / 8
"""Share by which what masks say goes towards one that shows a person less than those before."""

_MEMORY = 20
"""Looks that the share of those in which somebody was seen is taken over, at most."""


@dataclass(frozen=True)
class Existence:
    """
    What speaks for a track to be a person, and against it.

    ``said`` is the mean of what the last ``sightings`` of a detector say, and ``present`` what the
    masks of a network that draws them say, None if it never did; of ``looks`` it had ``hits``
    while they were known to be there, and ``missed`` the last.  ``found_ns`` is the stamp of the
    first frame, and ``moved_ns`` that of the last in which any of it moved, None if it never did;
    ``motion`` says how much of it has moved at most, 1 if it was enough for a person.
    """

    found_ns: int
    given: bool = False
    said: float = 0.0
    sightings: float = 0.0
    present: float | None = None
    moved_ns: int | None = None
    motion: float = 0.0
    unlike: bool = False
    hits: float = 1.0
    looks: float = 2.0
    missed: int = 0
    silence: float = 0.0

    def log_odds(self, stamp_ns: int) -> float:
        """Return the log-odds that it is a person, and there, in the frame of a stamp."""
        there = CERTAIN - self.silence + self.unlike * _UNLIKE
        return min(self.evidence(stamp_ns), there)

    def is_person(self, stamp_ns: int) -> bool:
        """Return whether it is rather a person, and there, in the frame of a stamp."""
        return self.log_odds(stamp_ns) >= 0

    def evidence(self, stamp_ns: int) -> float:
        """Return what speaks for a person, whether they are there now or not."""
        if self.given:
            return CERTAIN
        present, still = self.present or 0.0, stamp_ns - self.found_ns - _RESTS_NS
        seen = self.said + present + _AGAIN * (self.sightings > 1)
        rests = _STILL * min(max(still / _STILL_NS, 0.0), 1.0)
        if still >= 0 >= present:
            rests = min(rests, _RESTS)
        return seen + self.motion * _MOVED + (1 - self.motion) * rests

    @property
    def is_gone(self) -> bool:
        """Return whether they were not seen for so long that they are not there."""
        return self.silence >= CERTAIN

    def seen(self, score: float, share: float) -> Existence:
        """
        Return the existence after a look that saw them.

        :param score: of the detector, 0 to 1.
        :param share: height of the box, in longer sides of the image.
        """
        said = _by_height(share, score, _SCORES, _SMALL, _TALL)
        # Misses tell how reliably they are seen only if they were there, as is known now.
        looks, hits = self.looks + self.missed + 1, self.hits + 1
        fade = min(1.0, _MEMORY / looks)
        sightings = min(self.sightings + 1, _LATEST)
        return replace(
            self,
            said=self.said + (said - self.said) / sightings,
            sightings=sightings,
            hits=fade * hits,
            looks=fade * looks,
            missed=0,
            silence=0.0,
            unlike=False,
        )

    def drawn(self, presence: float, share: float) -> Existence:
        """
        Return the existence after a network has drawn what is there.

        :param presence: see ``SoftMask``.
        :param share: height of the box, in longer sides of the image.
        """
        said = _by_height(share, presence, _PRESENCES, _SMALL_PRESENT, _TALL_PRESENT)
        # Who is small or half hidden is not shown each time, and what is no person never.
        if self.present is None or said > self.present:
            return replace(self, present=said)
        return replace(self, present=self.present + _ABSENT_RATE * (said - self.present))

    def seen_again(self) -> Existence:
        """Return the existence after it was seen where it should be, whatever it looks like."""
        return replace(self, missed=0, silence=0.0, unlike=False)

    def unseen(self) -> Existence:
        """Return the existence after a look that did not see them where they should be."""
        said = -math.log(max(1 - self.hits / self.looks, 1e-3))
        return replace(self, missed=self.missed + 1, silence=self.silence + said)

    def moving(self, stamp_ns: int, share: float) -> Existence:
        """Return the existence after a frame in which a share of it moves against the world."""
        motion = max(self.motion, min(share / _MOST_MOVING, 1.0))
        return replace(self, moved_ns=stamp_ns, motion=motion, unlike=False)

    def is_on_trial(self, stamp_ns: int) -> bool:
        """Return whether they have hardly moved since they were found, but not for long."""
        resting = self.motion < 1 and not (self.given or self.is_gone)
        return resting and stamp_ns - self.found_ns < _TRIAL_NS

    def is_at_rest(self, stamp_ns: int) -> bool:
        """Return whether it is to be seen if what rests there is still the person."""
        return self.moved_ns is not None and stamp_ns - self.moved_ns >= _ASKED_NS

    def resting(self, *, alike: bool) -> Existence:
        """Return the existence after a frame at rest, in which it looks as they did, or not."""
        # Whom a detector surely sees has only come into other light, or another outline.
        is_seen = self.said >= _SURE and not self.missed
        return self if alike or is_seen else replace(self, unlike=True)

    def doubt(self, stamp_ns: int) -> str:
        """Return what speaks against a person in the frame of a stamp, '' if little does."""
        if self.is_person(stamp_ns):
            return ''
        if self.evidence(stamp_ns) < 0 and self.motion > 0.5:
            return 'it moves, but hardly looks like a person'
        if self.evidence(stamp_ns) < 0:
            return 'it has hardly moved since it was found'
        if self.unlike:
            return 'what is there does not move, and looks otherwise than they did'
        return 'the detector, which saw them, does not any more'


def _by_height(
    share: float,
    value: float,
    values: Sequence[float],
    small: Sequence[float],
    tall: Sequence[float],
) -> float:
    """Return what a value says of somebody of a height, in longer sides of the image."""
    said = [float(np.interp(value, values, each)) for each in (small, tall)]
    return float(np.interp(share, (_SMALL_SHARE, _TALL_SHARE), said))
