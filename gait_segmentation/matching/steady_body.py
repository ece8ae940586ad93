# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a body is, smoothed over the last frames."""

from __future__ import annotations

import dataclasses
import math
from collections import deque

from gait_segmentation.geometry import BodyFrame

__all__ = ['SteadyBody']

_FRAMES = 20
_LONGEST_S = 0.8
"""How many frames, and how much time, a line is drawn through."""
_JUMP = 0.25
"""Share of the height, of the place or of the height itself, from which on a body has jumped."""
_STILL = (0.04, 0.12, 0.12)
"""
Time in which a motion must show to be believed, across, down and in height: seconds that stand
still are added.  Walkers cross the image faster than they sink or grow in it.
"""


class SteadyBody:
    """
    Draws a straight line through the last places and heights of a body.

    A place of its own for every frame is a per cent of the height off, as much as a head rises
    and falls in a step.
    """

    def __init__(self) -> None:
        """Start without a body."""
        self.reset()

    def reset(self) -> None:
        """Forget the body."""
        self._last: deque[tuple[float, float, float, float]] = deque(maxlen=_FRAMES)

    def update(self, body: BodyFrame, seconds: float) -> BodyFrame:
        """
        Return the smoothed body.

        :param body: the body of a frame.
        :param seconds: its time, later than the last one.
        """
        size = math.log(body.height)
        if self._last:
            _, x, y, tall = self._last[-1]
            if math.hypot(body.center_x - x, body.center_y - y) > _JUMP * body.height or (
                abs(size - tall) > _JUMP
            ):
                self._last.clear()
        self._last.append((seconds, body.center_x, body.center_y, size))
        while seconds - self._last[0][0] > _LONGEST_S:
            self._last.popleft()
        # A few numbers: lists are faster than arrays.
        count = len(self._last)
        seconds_of, *places = zip(*self._last, strict=True)
        middle = sum(seconds_of) / count
        time = [each - middle for each in seconds_of]
        square = sum(each * each for each in time)
        smooth = []
        for place, still in zip(places, _STILL, strict=True):
            mean = sum(place) / count
            slope = sum(t * (p - mean) for t, p in zip(time, place, strict=True))
            smooth.append(mean + slope * time[-1] / (square + count * still**2))
        x, y, tall = smooth
        return dataclasses.replace(body, center_x=x, center_y=y, height=math.exp(tall))
