# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A running mean of an angle."""

from __future__ import annotations

import cmath
import math

__all__ = ['SteadyAngle']

_MEMORY_S = 0.7
"""Time constant of the mean."""
_JUMP = math.pi / 4
"""Radians from the mean from which on an angle has jumped."""


class SteadyAngle:
    """Averages an angle over time; starts anew when it jumps."""

    def __init__(self) -> None:
        """Start without an angle."""
        self.reset()

    def reset(self) -> None:
        """Forget the angle."""
        self._sum, self._weight, self._seconds = 0j, 0.0, 0.0

    def update(self, angle: float, seconds: float) -> float:
        """
        Return the mean in radians, in -pi..pi.

        :param angle: the angle of a frame in radians.
        :param seconds: its time, not earlier than the last one.
        """
        turn = cmath.exp(1j * angle)
        if self._weight and abs(cmath.phase(turn * self._sum.conjugate())) > _JUMP:
            self.reset()
        kept = math.exp(-(seconds - self._seconds) / _MEMORY_S) if self._weight else 0.0
        self._sum = kept * self._sum + turn
        self._weight = kept * self._weight + 1
        self._seconds = seconds
        return cmath.phase(self._sum)
