# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Competition of overlapping people for pixels.

Every person k judges pixels against the surroundings by a log-likelihood ratio L_k.  With several
people at one place the alternatives to k are the surroundings and all others::

    P_k = exp(L_k) / (1 + exp(L_k) + sum_j exp(C_j)),   C_j = L_j + g_j + d

where g_j <= 0 falls off away from where j is expected, so that people only compete where they
meet, and d is positive for those who stand nearer to the camera (lower feet) and negative for
those farther away.  As a log ratio this is L_k - ln(1 + sum_j exp(C_j)).  A pixel that
two still both find likely goes to the one whose L + g is greater.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import Window, overlap, size_of
from gait_segmentation.kernels import kernel
from gait_segmentation.tracking.likelihood.kernels import against_rivals, strengths
from gait_segmentation.tracking.nearness import REACH, Nearness, by_distance, nearness

__all__ = ['Claim', 'compete', 'leave_to']

_FARTHEST = -6.0
"""Log ratio that falls off up to :data:`REACH`, where somebody ceases to compete."""

_REFUSED = np.float32(-0.5)
"""Log ratio of a pixel for those who do not get it though they find it likely."""

_NOTHING = 1e-3
"""Ratio up to which somebody counts for nothing beside the surroundings."""

_BESIDE = np.float32(-3)
"""What falls off with the distance from the body where pixels are left to who is not known."""

_LEFT = np.float32(-3)
"""Log ratio of a pixel left to those who are not known."""

_NEARER = 1.5
"""Advantage, as a log ratio, of somebody who stands nearer."""

Corner = tuple[int, int]
"""Row and column of a window."""


@dataclass(frozen=True)
class Claim:
    """
    What one person makes of the pixels in a window.

    ``logit`` is (h, w) float32 and ``mask`` (h, w) uint8, where the person is expected;
    ``near`` tells how near to that the pixels of the window are, None if it is elsewhere.
    ``feet`` is the row of the soles and ``height`` that of the body, in pixels.  Somebody
    ``hidden`` competes, too, so that nobody takes what is about to be seen of them.  Of who is not
    ``known`` it cannot be told who stands nearer.
    """

    window: Window
    logit: NDArray[np.float32]
    mask: NDArray[np.uint8]
    near: Nearness | None
    feet: float
    height: float
    hidden: bool = False
    known: bool = True


def compete(claims: Sequence[Claim]) -> list[NDArray[np.float32]]:
    """
    Return the log ratio of each person against the surroundings and everybody else.

    :param claims: of people in one image; their arrays stay as they are.
    """
    pairs = [
        (one, two, shared)
        for one, two in itertools.combinations(range(len(claims)), 2)
        if (shared := overlap(claims[one].window, claims[two].window)) is not None
    ]
    met = {k for pair in pairs for k in pair[:2]}
    near = {index: _falloff(claims[index]) for index in met}
    strong = {index: _strength(claims[index].logit, near[index]) for index in met}
    rivals = {index: np.zeros_like(claims[index].logit) for index in met}
    for one, two, shared in pairs:
        for index, rival in ((one, two), (two, one)):
            claim = claims[index]
            depth = _NEARER if claim.feet > claims[rival].feet and not claim.hidden else -_NEARER
            if not (claim.known and claims[rival].known):
                depth = 0.0
            _add(
                strong[index],
                _corner(shared, claim.window),
                math.exp(depth),
                _NOTHING,
                rivals[rival],
                _corner(shared, claims[rival].window),
                size_of(shared),
            )
    logits = [
        _against(claim.logit, rivals[index]) if index in met else claim.logit
        for index, claim in enumerate(claims)
    ]
    for one, two, shared in pairs:
        _settle(
            logits[one],
            near[one],
            _corner(shared, claims[one].window),
            logits[two],
            near[two],
            _corner(shared, claims[two].window),
            size_of(shared),
        )
    return logits


def leave_to(
    strangers: NDArray[np.uint8],
    claim: Claim,
    logit: NDArray[np.float32],
    template: NDArray[np.uint8] | None,
) -> NDArray[np.float32]:
    """
    Return a log ratio without what is of people who are not known, away from the body.

    :param strangers: (H, W) uint8, non-zero where others move.
    :param logit: (h, w) float32 of the window of the claim.
    :param template: (h, w) uint8 of the window, the body as it is expected; the expected mask if
        None.
    """
    others = strangers[claim.window] > 0
    if not others.any():
        return logit
    near = claim.near
    if template is not None:
        near = nearness(template, claim.height)
    theirs = others & (_falloff(claim, near) < _BESIDE)
    return np.where(theirs, np.minimum(logit, _LEFT), logit)


def _strength(logit: NDArray[np.float32], near: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return what somebody has against the surroundings, zero where it is nothing at any depth."""
    out = np.empty_like(logit)
    strengths(logit, near, math.log(_NOTHING) - _NEARER, out)
    return out


def _against(logit: NDArray[np.float32], rivals: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the log ratio against the surroundings and others."""
    out = np.empty_like(logit)
    against_rivals(logit, rivals, out)
    return out


@kernel('f4[:,::1], UniTuple(i8, 2), f8, f8, f4[:,::1], UniTuple(i8, 2), UniTuple(i8, 2)')
def _add(
    strength: NDArray[np.float32],
    first: Corner,
    depth: float,
    nothing: float,
    rivals: NDArray[np.float32],
    second: Corner,
    size: tuple[int, int],
) -> None:
    """Add the strength of one person at some depth to that of the rivals of another."""
    factor, least, zero = np.float32(depth), np.float32(nothing), np.float32(0)
    height, width = size
    for row in range(height):
        here = strength[first[0] + row, first[1] : first[1] + width]
        result = rivals[second[0] + row, second[1] : second[1] + width]
        for col in range(width):
            value = factor * here[col]
            result[col] += value if value > least else zero


@kernel(
    'f4[:,::1], f4[:,::1], UniTuple(i8, 2), f4[:,::1], f4[:,::1], UniTuple(i8, 2), UniTuple(i8, 2)'
)
def _settle(
    one: NDArray[np.float32],
    near_one: NDArray[np.float32],
    first: Corner,
    two: NDArray[np.float32],
    near_two: NDArray[np.float32],
    second: Corner,
    size: tuple[int, int],
) -> None:
    """Refuse pixels that two find likely to the one who finds them less so."""
    height, width = size
    for row in range(height):
        y, v = first[0] + row, second[0] + row
        for col in range(width):
            x, u = first[1] + col, second[1] + col
            a, b = one[y, x], two[v, u]
            if a > 0 and b > 0:
                if a + near_one[y, x] >= b + near_two[v, u]:
                    two[v, u] = _REFUSED
                else:
                    one[y, x] = _REFUSED


def _falloff(claim: Claim, near: Nearness | None = None) -> NDArray[np.float32]:
    """Return g: 0 where the person is expected, falling off with the distance from there."""
    near = claim.near if near is None else near
    return by_distance(
        near, claim.logit.shape, -_FARTHEST / (REACH * claim.height), _FARTHEST, 0.0
    )


def _corner(part: Window, window: Window) -> Corner:
    """Return row and column of a window at which a part of the image begins."""
    return part[0].start - window[0].start, part[1].start - window[1].start
