# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The walk of everybody who was tracked, in a few numbers."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gait_segmentation.cli.replaying.output import Replayed
from gait_segmentation.pipeline import PersonResult

__all__ = ['STEPS_PER_STRIDE', 'Walk', 'Walks', 'has_silhouette']

STEPS_PER_STRIDE = 2

_LEAST_FRAMES = 5
"""Shorter walks are of no use: OpenGait warns of them."""

_LEAST_SUM = 10_000
"""Sum of the pixels (0/255) that OpenGait asks for in a silhouette."""

_VIEW_STEP = 45

_APART_S = 1.0
"""Between two places that give a speed: about a stride, within which people sway."""


@dataclass(frozen=True)
class Walk:
    """
    A track, over the frames that have a silhouette.

    ``walk`` is ``direction_rad``, the mean walking direction in the image, in degrees in steps of
    45: 000 = to the right, 090 = away from the camera, 180 = to the left, 270 = towards the
    camera.  Cadence and speed are medians, None where they are not known; the speed is that in
    the image, in heights of the body a second.  ``confidence`` is the mean of the match's.
    """

    person: int
    walk: str
    frames: int
    direction_rad: float
    cadence_steps_per_min: float | None
    speed_heights_per_s: float | None
    confidence: float


def has_silhouette(person: PersonResult) -> bool:
    """Return whether somebody is there, and large enough to be recognised."""
    return person.track.track_id > 0 and int(person.segmentation.mask.sum()) > _LEAST_SUM


class Walks:
    """Follows everybody through the frames."""

    def __init__(self) -> None:
        """Begin without walks."""
        self._seen: dict[int, list[tuple[float, ...]]] = {}

    def add(self, replayed: Replayed) -> None:
        """Add a frame."""
        for person in replayed.result.people:
            if has_silhouette(person):
                match = person.match
                about = (match.stamp_ns / 1e9, match.azimuth, match.confidence)
                gait = (math.nan,) * 4
                if match.body is not None:
                    body = match.body
                    gait = (match.phase_rate, body.center_x, body.center_y, body.height)
                self._seen.setdefault(person.track.track_id, []).append(about + gait)

    def all(self) -> list[Walk]:
        """Return the walks that are long enough, by track id."""
        return [
            _walk(track_id, np.array(seen))
            for track_id, seen in sorted(self._seen.items())
            if len(seen) >= _LEAST_FRAMES
        ]


def _walk(track_id: int, seen: np.ndarray) -> Walk:
    azimuth, confidence = seen[:, 1], seen[:, 2]
    times, _, _, rates, x, y, heights = seen[np.isfinite(seen[:, 3])].T
    direction = math.atan2(float(np.sin(azimuth).mean()), float(np.cos(azimuth).mean()))
    later = np.searchsorted(times, times + _APART_S)
    first = np.flatnonzero(later < len(times))
    later = later[first]
    moved = np.hypot(x[later] - x[first], y[later] - y[first])
    height = (heights[later] + heights[first]) / 2
    return Walk(
        track_id,
        f'{round(math.degrees(direction) / _VIEW_STEP) * _VIEW_STEP % 360:03d}',
        len(seen),
        round(direction, 4),
        _median(60 * STEPS_PER_STRIDE * rates, 1),
        _median(moved / height / (times[later] - times[first]), 3),
        round(float(confidence.mean()), 3),
    )


def _median(values: np.ndarray, digits: int) -> float | None:
    return round(float(np.median(values)), digits) if len(values) else None
