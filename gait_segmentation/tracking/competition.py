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
from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.images import Window, bounding_box

__all__ = ['Claim', 'compete', 'leave_to', 'overlap']

_REACH = 0.12
"""Distance from the expected mask at which somebody ceases to compete, in body heights."""

_FARTHEST = -6.0
_REFUSED = np.float32(-0.5)
"""Log ratio of a pixel for those who do not get it though they find it likely."""

_NOTHING = np.float32(-7)
"""Log ratio from which somebody counts for nothing beside the surroundings: one in a thousand."""

_BESIDE = np.float32(-3)
"""What falls off with the distance from the body where pixels are left to who is not known."""

_LEFT = np.float32(-3)
"""Log ratio of a pixel left to those who are not known."""

_NEARER = 1.5
"""Advantage, as a log ratio, of somebody who stands nearer."""


@dataclass(frozen=True)
class Claim:
    """
    What one person makes of the pixels in a window.

    ``logit`` is (h, w) float32 and ``mask`` (H, W) uint8, where the person is expected in the
    image.  ``feet`` is the row of the soles and ``height`` that of the body, in pixels.
    Somebody ``hidden`` competes, too, so that nobody takes what is about to be seen of them.
    """

    window: Window
    logit: NDArray[np.float32]
    mask: NDArray[np.uint8]
    feet: float
    height: float
    hidden: bool = False


def overlap(one: Window, two: Window) -> Window | None:
    """Return the rows and columns two windows share, None if there are none."""
    rows, columns = (
        slice(max(a.start, b.start), min(a.stop, b.stop)) for a, b in zip(one, two, strict=True)
    )
    if rows.start >= rows.stop or columns.start >= columns.stop:
        return None
    return rows, columns


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
    near = {index: _nearby(claims[index]) for index in {k for pair in pairs for k in pair[:2]}}
    others = {index: np.zeros_like(claims[index].logit) for index in near}
    for one, two, shared in pairs:
        for index, rival in ((one, two), (two, one)):
            claim = claims[index]
            part = _within(shared, claim.window)
            nearer = claim.feet > claims[rival].feet and not claim.hidden
            depth = np.float32(_NEARER if nearer else -_NEARER)
            rest = others[rival][_within(shared, claims[rival].window)]
            _add_strength(claim.logit[part], near[index][part], depth, rest)
    logits = [
        _against(claim.logit, others[index]) if index in others else claim.logit
        for index, claim in enumerate(claims)
    ]
    for one, two, shared in pairs:
        first, second = _within(shared, claims[one].window), _within(shared, claims[two].window)
        _settle(logits[one][first], logits[two][second], near[one][first], near[two][second])
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
    :param template: (H, W) uint8, the body as it is expected; the expected mask if None.
    """
    others = strangers[claim.window] > 0
    if not others.any():
        return logit
    body = claim if template is None else replace(claim, mask=template)
    theirs = others & (_nearby(body) < _BESIDE)
    return np.where(theirs, np.minimum(logit, _LEFT), logit)


@njit(cache=True, nogil=True)
def _add_strength(
    logit: NDArray[np.float32],
    near: NDArray[np.float32],
    depth: np.float32,
    rest: NDArray[np.float32],
) -> None:
    for row in range(logit.shape[0]):
        for col in range(logit.shape[1]):
            strength = logit[row, col] + near[row, col] + depth
            if strength > _NOTHING:
                rest[row, col] += np.exp(strength)


@njit(cache=True, nogil=True)
def _against(logit: NDArray[np.float32], rest: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the log ratio against the surroundings and others, who are nowhere mostly."""
    out = np.empty_like(logit)
    for row in range(logit.shape[0]):
        for col in range(logit.shape[1]):
            out[row, col] = logit[row, col]
            if rest[row, col] > 0:
                out[row, col] -= np.log1p(rest[row, col])
    return out


@njit(cache=True, nogil=True)
def _settle(
    one: NDArray[np.float32],
    two: NDArray[np.float32],
    near_one: NDArray[np.float32],
    near_two: NDArray[np.float32],
) -> None:
    """Refuse pixels that two find likely to the one who finds them less so."""
    for row in range(one.shape[0]):
        for col in range(one.shape[1]):
            a, b = one[row, col], two[row, col]
            if a > 0 and b > 0:
                if a + near_one[row, col] >= b + near_two[row, col]:
                    two[row, col] = _REFUSED
                else:
                    one[row, col] = _REFUSED


def _nearby(claim: Claim) -> NDArray[np.float32]:
    """Return g: 0 where the person is expected, falling off with the distance from there."""
    part = claim.mask[claim.window]
    near = np.full(part.shape, _FARTHEST, np.float32)
    left, top, width, height = bounding_box(part)
    if width == 0:
        return near
    # Farther than this everything is the same.
    margin = int(np.ceil(_REACH * claim.height)) + 1
    around = (
        slice(max(top - margin, 0), top + height + margin),
        slice(max(left - margin, 0), left + width + margin),
    )
    distance = cv2.distanceTransform(cv2.inRange(part[around], 0, 127), cv2.DIST_L2, 3)
    slope = np.float32(_FARTHEST / (_REACH * claim.height))
    near[around] = np.maximum(slope * distance, np.float32(_FARTHEST))
    return near


def _within(part: Window, window: Window) -> Window:
    """Return a part of the image as rows and columns of a window."""
    rows, columns = (
        slice(a.start - b.start, a.stop - b.start) for a, b in zip(part, window, strict=True)
    )
    return rows, columns
