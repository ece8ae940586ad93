# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Topics, and what their messages say of a result in numbers: shared by nodes and commands."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple, TypeVar

from gait_segmentation.geometry import BodyFrame, Box
from gait_segmentation.people import slot_name

if TYPE_CHECKING:
    from gait_segmentation.results import MatchResult, TrackResult

__all__ = [
    'DEPTH',
    'GAIT_NAMES',
    'TEMPLATE_NAMES',
    'Corners',
    'Joints',
    'gait_joints',
    'matched_corners',
    'refined_corners',
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

TEMPLATE_NAMES = ('template_sequence', 'template_phase')
"""Further joints, which nobody needs to send: the numbers of the matched template in the bank."""

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


def matched_corners(match: MatchResult) -> Corners:
    """
    Return what ``matched_box`` says: a rectangle along the body's axis, as high as the body.

    It is as wide as the refined box, or half as wide as high where there is none.
    """
    if match.body is None:
        return ()
    height = match.body.height
    return match.body.corners(height / 2 if match.box is None else match.box.width)


def refined_corners(match: MatchResult) -> Corners:
    """Return what ``refined_box`` says of a match."""
    return () if match.box is None else match.box.corners()


def gait_joints(match: MatchResult) -> Joints:
    """Return what ``gait`` says of a match."""
    if match.body is None:
        return Joints((), (), (), ())
    turn = 2 * math.pi
    return Joints(
        GAIT_NAMES + TEMPLATE_NAMES,
        (turn * match.phase, match.azimuth, float(match.sequence), float(match.phase_index)),
        (turn * match.phase_rate, 0.0, 0.0, 0.0),
        (match.confidence, match.similarity, match.similarity, match.similarity),
    )
