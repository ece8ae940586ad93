# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Jumps of the tracked box against the body it follows."""

from __future__ import annotations

import math

from gait_segmentation.geometry import Box

__all__ = ['BoxMotion']

_GAIN = 0.3
"""Share of the newest speed in its running mean."""
_LONGEST_S = 0.5
"""Pause after which the speed is taken anew."""
_FASTEST = 2.0
"""Largest speed, along each axis, in box heights per second."""


class BoxMotion:
    """
    Tells jumps of a box from the motion of the body.

    Placements are relative to the box, and the path lets them move by one step from frame to
    frame.  A box that moves steadily takes its placements along; one that jumps against its own
    steady motion leaves the body behind, and the path's placements must be moved the other way.
    """

    def __init__(self) -> None:
        """Start without a box."""
        self.reset()

    def reset(self) -> None:
        """Forget the box."""
        self._last: Box | None = None
        self._seconds = 0.0
        self._speed: tuple[float, float] | None = None

    def update(
        self, box: Box, seconds: float, shift: float, log_step: float
    ) -> tuple[int, int, int]:
        """
        Return the jump of a box in whole placements: body heights, down and right.

        :param box: the box of this frame, in source pixels.
        :param seconds: its time, later than the last one.
        :param shift: distance of neighbouring placements in box heights.
        :param log_step: logarithm of the ratio of neighbouring body heights.
        """
        last, passed = self._last, seconds - self._seconds
        self._last, self._seconds = box, seconds
        if last is None:
            return 0, 0, 0
        off_x = (box.center_x - last.center_x) / box.height
        off_y = (box.center_y - last.center_y) / box.height
        speed = self._speed
        fresh = tuple(max(-_FASTEST, min(_FASTEST, off / passed)) for off in (off_x, off_y))
        if speed is None or passed > _LONGEST_S:
            self._speed = fresh[0], fresh[1]
            return 0, 0, 0
        self._speed = (
            speed[0] + _GAIN * (fresh[0] - speed[0]),
            speed[1] + _GAIN * (fresh[1] - speed[1]),
        )
        jump = (
            round(math.log(box.height / last.height) / log_step),
            round((off_y - speed[1] * passed) / shift),
            round((off_x - speed[0] * passed) / shift),
        )
        # One step is what the path itself may do.
        scale, down, right = (0 if abs(steps) < 2 else steps for steps in jump)
        return scale, down, right
