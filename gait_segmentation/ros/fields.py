# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Topics, and what their messages say of a result in numbers: shared by nodes and commands.

Nothing here needs ROS, so that a bag can be written without it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np

from gait_segmentation.geometry import BodyFrame, Box
from gait_segmentation.people import slot_name

if TYPE_CHECKING:
    from gait_segmentation.gait_model import TemplateBank
    from gait_segmentation.results import MatchResult, TrackResult

__all__ = [
    'DEPTH',
    'GAIT_NAMES',
    'Corners',
    'Joints',
    'gait_joints',
    'matched_corners',
    'slot_topic',
    'slot_topics',
    'tilted_corners',
    'track_corners',
]

Kind = TypeVar('Kind')

DEPTH = 30
"""
Frames that a publisher keeps for a reader that is slow to acknowledge; as many may wait for their
other parts.
"""

GAIT_NAMES = ('gait_phase', 'view_azimuth')
"""
Joints of the gait message: radians of the stride with their rate, and walking direction.

Their efforts say how sure they are: the probability that the phase is right, and the similarity of
the matched template with the likelihood, both 0..1.
"""

Corners = tuple[tuple[float, float], ...]
"""Four (x, y) clockwise from the body's top left, none if nobody is tracked."""


class Joints(NamedTuple):
    """The fields of a gait message, all empty if nobody is tracked."""

    names: tuple[str, ...]
    positions: tuple[float, ...]
    velocities: tuple[float, ...]
    efforts: tuple[float, ...]


def slot_topic(slot: int, name: str) -> str:
    """Return the relative topic for one kind of output of a slot, such as ``person_0/box``."""
    return f'{slot_name(slot)}/{name}'


def slot_topics(kinds: Mapping[str, Kind], slots: int) -> dict[str, Kind]:
    """
    Return the message types of all slots by topic.

    :param kinds: those of one slot by name.
    """
    return {slot_topic(slot, name): kind for slot in range(slots) for name, kind in kinds.items()}


def tilted_corners(box: Box, angle: float) -> Corners:
    """Return the corners of a tracked box that is turned by ``angle`` about its centre."""
    if not angle:
        return box.corners()
    return BodyFrame(box.center_x, box.center_y, box.height, angle).corners(box.width)


def track_corners(track: TrackResult) -> Corners:
    """Return what ``box`` says of a track."""
    return () if track.body is None else tilted_corners(track.body, track.angle)


def matched_corners(match: MatchResult, bank: TemplateBank) -> Corners:
    """Return what ``matched_box`` says: a rectangle about the template along the body's axis."""
    if match.body is None:
        return ()
    return match.body.corners(match.body.height * _relative_width(match, bank))


def _relative_width(match: MatchResult, bank: TemplateBank) -> float:
    """Return the width of the matched template about the body's axis, in body heights."""
    template = bank.templates[match.sequence, match.phase_index]
    rows, columns = template.shape
    inside = np.flatnonzero((template > 127).any(axis=0))
    if not inside.size:
        return 1.0
    half = max(columns / 2 - inside[0], inside[-1] + 1 - columns / 2)
    return float(2 * half / (rows * bank.fill))


def gait_joints(match: MatchResult) -> Joints:
    """Return what ``gait`` says of a match."""
    if match.body is None:
        return Joints((), (), (), ())
    turn = 2 * math.pi
    positions, velocities = (turn * match.phase, match.azimuth), (turn * match.phase_rate, 0.0)
    return Joints(GAIT_NAMES, positions, velocities, (match.confidence, match.similarity))
