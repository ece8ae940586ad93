# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Association of pixels with people who overlap.

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

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import REACH
from gait_segmentation.images import Window, distance_from, overlap, within

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
