# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which shifts of a body between two frames can be the person's, by the pace so far."""

from __future__ import annotations

import math

__all__ = ['STEADY_AFTER', 'is_astray']

STEADY_AFTER = 4
"""Frames after which the pace is known well enough to be kept to."""

_OFF, _OFF_SHARE = 0.03, 0.6
"""
Difference from the pace, in body heights and as a share of it, from which a shift is taken for
that of somebody else who is near.  Most who pass by go the other way.
"""

_JUMP = 0.2
"""Difference, in body heights, that is no step of somebody of whom little is seen."""


def is_astray(
    shift: tuple[float, float],
    usual: tuple[float, float],
    way: float,
    height: float,
    *,
    company: bool,
    hidden: bool,
) -> bool:
    """
    Return whether a shift that was measured is not the person's.

    Nobody turns round from one frame to the next.

    :param shift: measured, in pixels of the image.
    :param usual: expected at the pace so far, likewise.
    :param way: length of the way at that pace over the still world, in pixels.
    :param height: of the body in pixels.
    :param company: whether somebody without a slot is near, who may have been followed instead.
    :param hidden: whether little of the person is seen, so that a few pixels on an edge may be.
    """
    off = math.dist(shift, usual)
    if hidden and off > _JUMP * height:
        return True
    return company and off > max(_OFF * height, _OFF_SHARE * way)
