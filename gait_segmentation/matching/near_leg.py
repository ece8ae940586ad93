# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""From the phase of the right leg to that of the leg nearer to the camera."""

from __future__ import annotations

import math

__all__ = ['NearLeg']

_TURNED = math.cos(math.radians(60.0))
"""Cosine of the azimuth above which it can be seen which leg is nearer."""
_WAITS = 0.25
"""Strides by which a phase may lie behind the last one and be taken for a stand-still."""


class NearLeg:
    """
    Counts the stride from the leg nearer to the camera, and never backwards.

    Seen from the front or back neither leg is nearer.  Within 30 degrees of the camera's axis the
    leg therefore stays the one it was, so that the phase goes on while the view wavers about the
    axis; a person who turns from one side to the other changes legs, half a stride, once.
    """

    def __init__(self) -> None:
        """Start without a walker."""
        self.reset()

    def reset(self) -> None:
        """Forget the walker."""
        self._right: bool | None = None
        self._last: float | None = None
        self._before: tuple[float, float] | None = None

    def expected(self, seconds: float, rate: float) -> float | None:
        """
        Return the phase of the right leg that a steady walk leads to, None at first.

        :param seconds: time of the frame.
        :param rate: strides per second.
        """
        if self._before is None:
            return None
        phase, then = self._before
        return phase + rate * (seconds - then)

    def update(self, phase: float, azimuth: float, seconds: float) -> float:
        """
        Return the phase of a frame, in [0, 1).

        Phases up to a quarter of a stride behind the last one wait for it: nobody walks
        backwards, so the estimate was ahead.  Others are jumps, taken as they are.

        :param phase: strides, 0 = heel contact of the right leg.
        :param azimuth: direction of walking in radians, 0 to the right in the image.
        :param seconds: time of the frame.
        """
        self._before = phase, seconds
        across = math.cos(azimuth)
        if self._right is None or abs(across) > _TURNED:
            self._right = across > -1e-9
        phase = (phase if self._right else phase + 0.5) % 1.0
        if self._last is not None and 0 < (self._last - phase) % 1.0 < _WAITS:
            phase = self._last
        self._last = phase
        return phase
