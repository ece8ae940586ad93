# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What may follow what: phases, views and builds."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.matching.config import MatchingConfig

__all__ = ['UNIT', 'phase_costs', 'turned', 'view_changes']

UNIT = 2048
"""Whole numbers that a similarity of 1 is in path scores."""


def turned(angle: float) -> float:
    """Return an angle in [-pi, pi)."""
    return (angle + math.pi) % (2 * math.pi) - math.pi


def phase_costs(
    phases: int, seconds: float, rate: float, maximum_rate: float, cost: float
) -> NDArray[np.int16]:
    """
    Return what it costs to advance by 0, 1, 2, ... phases between two frames.

    Standing still is allowed and going back is not.

    :param phases: phases of a stride.
    :param seconds: time between the frames.
    :param rate: expected strides per second.
    :param maximum_rate: most strides per second that are possible.
    :param cost: similarity that a whole stride off the expectation costs.
    :returns: (D,) int16 in path units, D at most ``phases``.
    """
    most = min(max(math.ceil(phases * maximum_rate * seconds - 1e-9), 1), phases - 1)
    expected = min(rate * seconds, most / phases)
    off = (abs(steps / phases - expected) for steps in range(most + 1))
    return np.array([min(round(UNIT * cost * each), UNIT) for each in off], np.int16)


@lru_cache(maxsize=4)
def view_changes(
    bank: TemplateBank, config: MatchingConfig
) -> tuple[NDArray[np.int32], NDArray[np.int16]]:
    """
    Return from which sequences each sequence can be reached in one frame.

    These are the neighbouring views of the same build, and the same view of other builds.

    :returns: (V, M) int32 sequences, -1 where there are fewer, and (V, M) int16 costs.
    """
    views = [round(float(azimuth), 6) for azimuth in bank.azimuth]
    around = {
        build: sorted(
            {
                v % round(2 * math.pi, 6)
                for v, b in zip(views, bank.builds, strict=True)
                if b == build
            }
        )
        for build in set(bank.builds)
    }
    found: list[list[tuple[int, float]]] = []
    for view, build in zip(views, bank.builds, strict=True):
        ring = around[build]
        place = ring.index(view % round(2 * math.pi, 6))
        beside = {ring[place - 1], ring[(place + 1) % len(ring)]} - {ring[place]}
        reached = []
        for other, (azimuth, name) in enumerate(zip(views, bank.builds, strict=True)):
            if name == build and azimuth % round(2 * math.pi, 6) in beside:
                reached.append((other, config.view_cost))
            elif name != build and abs(turned(azimuth - view)) < 1e-3:
                reached.append((other, config.build_cost))
        found.append(reached)
    most = max((len(reached) for reached in found), default=0)
    sequences = np.full((len(found), most), -1, np.int32)
    costs = np.zeros((len(found), most), np.int16)
    for index, reached in enumerate(found):
        for place, (other, cost) in enumerate(reached):
            sequences[index, place] = other
            costs[index, place] = min(round(UNIT * cost), UNIT)
    return sequences, costs
