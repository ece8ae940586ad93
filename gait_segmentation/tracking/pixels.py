# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
What likelihood images show of people: how much of each, where, and whose each pixel is.

Every person k judges pixels against the surroundings by a log-likelihood ratio L_k.  With several
people at one place the alternatives to k are the surroundings and all others::

    P_k = exp(L_k) / (1 + exp(L_k) + sum_j exp(C_j)),   C_j = L_j + g_j + d

where g_j <= 0 falls off away from where j is expected, so that people only compete where they
meet, and d grows from negative to positive with how much nearer to the camera j stands (lower
feet).  As a log ratio this is L_k - ln(1 + sum_j exp(C_j)).  A pixel that
two still both find likely goes to the one whose L + g is greater.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import REACH, Box
from gait_segmentation.images import Window, distance_from, inner_range, overlap, within

GUARD = 0.05
"""How far outside of the last mask or the template pixels are the person's, in body heights."""

LEAST_SEEN = 0.25
"""Share of a person below which nothing is known: neither learnt nor followed."""

OUTERMOST = 0.005
"""Share of the pixels on each side that does not count where a person is measured."""

ALONE = 0.9
"""Share that must not be hidden by others, so that what hides the rest is the background."""

_FARTHEST = -6.0
"""Log ratio that falls off up to :data:`.REACH`, where a person ceases to compete."""

_REFUSED = np.float32(-0.5)
"""Log ratio of a pixel for those who do not get it though they find it likely."""

_NEARER, _SURE = 1.5, 0.05
"""
Advantage, as a log ratio, of a person who surely stands nearer, and by how much lower feet tell
that, in body heights.
"""


@dataclass(frozen=True)
class Visibility:
    """
    What of a person can be seen where the person is expected.

    ``unoccluded`` is (h, w) uint8 0/255, the expected mask without what others hide, and
    ``share`` its share of that mask.  ``inside`` and ``outside`` are the mean likelihoods (0..1)
    in what is unoccluded and around the person.
    """

    unoccluded: NDArray[np.uint8]
    share: float
    inside: float
    outside: float

    @classmethod
    def of(
        cls,
        values: NDArray[np.uint8],
        expected: NDArray[np.uint8],
        occluder: NDArray[np.uint8] | None,
        apart: NDArray[np.uint8] | None = None,
    ) -> Visibility:
        """
        Measure a window.

        :param values: (h, w) uint8 likelihood.
        :param expected: (h, w) uint8 0/255, where the person is expected.
        :param occluder: non-zero where others hide the person, None if nowhere.
        :param apart: non-zero where it is neither the person nor around, None if nowhere.
        """
        person = expected if apart is None else expected | apart
        outside = cv2.mean(values, ~person)[0] / 255
        whole = cls(expected, 1.0, cv2.mean(values, expected)[0] / 255, outside)
        return whole if occluder is None else whole.where(occluder == 0, values)

    def where(self, visible: NDArray[np.bool_], values: NDArray[np.uint8]) -> Visibility:
        """
        Return the visibility of what can be seen in part of the window only.

        :param values: (h, w) uint8 likelihood.
        """
        unoccluded = np.where(visible, self.unoccluded, np.uint8(0))
        share = cv2.countNonZero(unoccluded) / max(cv2.countNonZero(self.unoccluded), 1)
        inside = cv2.mean(values, unoccluded)[0] / 255
        return Visibility(unoccluded, self.share * share, inside, self.outside)

    @property
    def seen(self) -> float:
        """Return the share of the person that can be seen."""
        return self.share * self.inside

    @property
    def contrast(self) -> float:
        """Return how much likelier the person is than what is around."""
        return self.inside - self.outside

    @property
    def confidence(self) -> float:
        """Return how well the person stands out, of which what is hidden takes its share."""
        return self.share * max(0.0, self.contrast)


def visible_box(
    values: NDArray[np.uint8],
    mask: NDArray[np.uint8],
    away: NDArray[np.float32],
    window: Window,
    height: float,
) -> Box | None:
    """
    Return the tight box of the likely pixels near a mask, None if they are few.

    :param values: (h, w) uint8 likelihood of the window.
    :param mask: (h, w) uint8 0/255, what of the person is not hidden.
    :param away: (h, w) float32, how far beside the person expected pixels are.
    :param height: of the body in pixels.
    """
    likely = ((values > 127) & (away <= max(1.0, GUARD * height))).view(np.uint8)
    if cv2.countNonZero(likely) < max(1.0, LEAST_SEEN * cv2.countNonZero(mask)):
        return None
    (top, bottom), (left, right) = (
        inner_range(cv2.reduce(likely, axis, cv2.REDUCE_SUM, dtype=cv2.CV_32S), OUTERMOST)
        for axis in (1, 0)
    )
    return Box(window[1].start + left, window[0].start + top, right - left, bottom - top)


@dataclass(frozen=True)
class PixelClaim:
    """
    What one person makes of the pixels in a window.

    ``logit`` is (h, w) float32 and ``mask`` (h, w) uint8, where the person is expected;
    ``away`` is (h, w) float32, how far beside it pixels are, in pixels, and ``body`` (h, w) uint8
    the matched template, None without one.
    ``feet`` is the row of the soles and ``height`` that of the body, in pixels.  A person
    ``hidden`` competes, too, so that no one takes what is about to be seen of them.  One who is
    ``vague``, as nobody has seen their outline, competes only for what both find likely.
    """

    window: Window
    logit: NDArray[np.float32]
    mask: NDArray[np.uint8]
    away: NDArray[np.float32]
    feet: float
    height: float
    hidden: bool = False
    body: NDArray[np.uint8] | None = None
    vague: bool = False

    @property
    def falloff(self) -> NDArray[np.float32]:
        """Return g: 0 where the person is expected, falling off with the distance from there."""
        # By the body, if it is known: a mask that has taken in another person would keep them.
        away = self.away if self.body is None else distance_from(self.body > 127)
        return np.float32(_FARTHEST) * beyond(away, self.height)


def associate(claims: Sequence[PixelClaim]) -> list[NDArray[np.float32]]:
    """
    Return the log ratio of each person against the surroundings and all others.

    :param claims: of people in one image; their arrays stay as they are.
    """
    pairs = [
        (one, two, shared)
        for one, two in itertools.permutations(range(len(claims)), 2)
        if (shared := overlap(claims[one].window, claims[two].window)) is not None
    ]
    near = {one: claims[one].falloff for one, _, _ in pairs}
    strong = {k: np.exp(claims[k].logit + near[k]) for k in near}
    rivals = {k: np.zeros_like(strong[k]) for k in near}
    for one, two, shared in pairs:
        claim, other = claims[one], claims[two]
        if claim.vague:
            continue
        nearer = (claim.feet - other.feet) / (_SURE * max(claim.height, other.height))
        depth = -_NEARER if claim.hidden else _NEARER * min(max(nearer, -1.0), 1.0)
        part = strong[one][within(shared, claim.window)]
        rivals[two][within(shared, other.window)] += np.float32(math.exp(depth)) * part
    logits = [
        claim.logit - np.log1p(rivals[k]) if k in near else claim.logit
        for k, claim in enumerate(claims)
    ]
    for one, two, shared in pairs:
        # Of pixels that two find likely the one who finds them less so is refused.
        here, there = (within(shared, claims[k].window) for k in (one, two))
        mine, yours = logits[one][here], logits[two][there]
        both, first = (mine > 0) & (yours > 0), mine + near[one][here] >= yours + near[two][there]
        yours[both & first] = _REFUSED
        mine[both & ~first] = _REFUSED
    return logits


def beyond(away: NDArray[np.float32], height: float) -> NDArray[np.float32]:
    """
    Return how far beside a person pixels are, from 0 on the outline to 1 out of reach.

    :param away: (h, w) float32, distance from the person in pixels.
    :param height: of the body in pixels.
    """
    reach = np.float32(REACH * height)
    return np.minimum(away, reach) / reach
