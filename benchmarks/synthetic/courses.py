# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where made-up people walk: straight on, or from point to point with turns and stops."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import InputError

__all__ = ['STRIDE_LENGTH', 'Course', 'Straight', 'Whereabouts']

STRIDE_LENGTH = 0.83
"""In statures."""

_TURN = math.pi / 0.9
"""Radians per second of turning round."""

_STEP = 0.01
"""Seconds between the points of a course."""

_NEAR = 0.03
"""Statures from a point at which it counts as reached."""

_MID_STANCE = 0.3
"""Phase (and half a stride later) at which the legs are side by side: where people stop."""

_VIEWS = 120
"""Directions a turning walker is drawn in: each has to be rendered."""


@dataclass(frozen=True)
class Whereabouts:
    """
    Where somebody is, in which direction and with which legs.

    ``x`` (to the right) and ``z`` (away from the camera) in statures, ``azimuth`` in radians (0 to
    the right, pi/2 away), ``phase`` in [0, 1), 0 = contact of the right heel.
    """

    x: float
    z: float
    azimuth: float
    phase: float


@dataclass(frozen=True)
class Straight:
    """
    Straight on at one speed.

    ``x``, ``z`` and ``phase`` hold half way; ``stride_rate`` is in strides per second.
    """

    x: float
    z: float
    azimuth: float
    stride_rate: float
    phase: float

    def at(self, seconds: float) -> Whereabouts:
        """Return where the walker is at a time after half way of the clip."""
        way = STRIDE_LENGTH * self.stride_rate * seconds
        return Whereabouts(
            self.x + way * math.cos(self.azimuth),
            self.z + way * math.sin(self.azimuth),
            self.azimuth,
            (self.phase + self.stride_rate * seconds) % 1.0,
        )


@dataclass(frozen=True)
class Course:
    """
    From point to point, and straight on after the last.

    Who comes to a point turns towards the next on a small arc, legs moving; who stops, stops with
    the legs side by side.

    :param points: (x, z) in statures, at least two.
    :param begins: seconds after half way of the clip at which the walker leaves the first point.
    :param ends: seconds after half way until which the course is needed; there the walker stays.
    :param stops: index of a point -> seconds of standing there.
    :raises InputError: if there are fewer than two points or a stop is at none of them.
    """

    points: Sequence[tuple[float, float]]
    stride_rate: float
    phase: float
    begins: float
    ends: float
    stops: Mapping[int, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Walk the course once."""
        if len(self.points) < 2:
            raise InputError(f'a course needs at least two points, got {len(self.points)}')
        wrong = [index for index in self.stops if not 0 <= index < len(self.points)]
        if wrong:
            raise InputError(
                f'a stop must be at a point from 0 to {len(self.points) - 1}, got {wrong[0]}'
            )
        object.__setattr__(self, '_track', self._walk())

    def at(self, seconds: float) -> Whereabouts:
        """Return where the walker is at a time after half way of the clip."""
        track: NDArray[np.float64] = self._track  # type: ignore[attr-defined]
        place = min(max((seconds - self.begins) / _STEP, 0.0), len(track) - 1.0)
        before = int(place)
        after = min(before + 1, len(track) - 1)
        x, z, azimuth, phase = track[before] + (place - before) * (track[after] - track[before])
        step = 2 * math.pi / _VIEWS
        azimuth = math.remainder(round(azimuth / step) * step, 2 * math.pi)
        return Whereabouts(float(x), float(z), azimuth, float(phase % 1.0))

    def _walk(self) -> NDArray[np.float64]:
        """Return (n, 4) x, z, azimuth and phase, neither wrapped, every hundredth of a second."""
        goals = [np.array(point, np.float64) for point in self.points]
        place, target = goals[0].copy(), 1
        azimuth = _direction(goals[1] - goals[0])
        phase, pause = self.phase, self.stops.get(0, 0.0)
        track = []
        for _ in range(max(math.ceil((self.ends - self.begins) / _STEP), 0) + 1):
            track.append((*place, azimuth, phase))
            if pause > 0:
                pause -= _STEP
                phase += min((_MID_STANCE - phase) % 0.5, self.stride_rate * _STEP)
                continue
            error = 0.0
            if target < len(goals):
                error = math.remainder(_direction(goals[target] - place) - azimuth, 2 * math.pi)
            azimuth += min(max(error, -_TURN * _STEP), _TURN * _STEP)
            ahead = max(math.cos(error), 0.0)
            pace = STRIDE_LENGTH * self.stride_rate * _STEP * ahead
            place = place + pace * np.array([math.cos(azimuth), math.sin(azimuth)])
            phase += self.stride_rate * _STEP * (0.5 + 0.5 * ahead)
            if target < len(goals) and float(np.hypot(*(goals[target] - place))) < _NEAR:
                pause = self.stops.get(target, 0.0)
                target += 1
        return np.array(track)


def _direction(way: NDArray[np.float64]) -> float:
    return math.atan2(float(way[1]), float(way[0]))
