# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Topics, and what messages of any class with ROS's fields say of a result, in both directions."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any, TypeVar

from gait_segmentation.encodings import read_mono8
from gait_segmentation.errors import InputError
from gait_segmentation.geometry import BodyFrame, Box
from gait_segmentation.people import slot_name
from gait_segmentation.results import Feedback, MatchResult, TrackResult

Kind = TypeVar('Kind')

QUEUE_DEPTH = 30
"""Frames that a publisher keeps for slow readers, and that may wait for their other parts."""

GAIT_NAMES = ('gait_phase', 'view_azimuth')
"""Joints of the gait message: radians, and as effort how sure they are."""

TEMPLATE_NAMES = ('template_sequence', 'template_phase')
"""Further joints, which are optional: the numbers of the matched template in the bank."""

Corners = tuple[tuple[float, float], ...]
"""Four (x, y) clockwise from the body's top left, none if no person is tracked."""


def slot_topic(slot: int, name: str) -> str:
    """Return the relative topic for one kind of output of a slot, such as ``person_0/box``."""
    return f'{slot_name(slot)}/{name}'


def slot_topics(kinds: Mapping[str, Kind], slots: int) -> dict[str, Kind]:
    """Return the message types of all slots by topic, given those of one by name."""
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
    """Return what ``matched_box`` says: the tracked box, turned as it is, where the path is."""
    if match.body is None or match.placed is None:
        return ()
    return match.body.corners(match.placed.width)


def refined_corners(match: MatchResult) -> Corners:
    """Return what ``refined_box`` says of a match."""
    return () if match.box is None else match.box.corners()


def gait_joints(match: MatchResult) -> tuple[tuple[Any, ...], ...]:
    """Return names, positions, velocities and efforts of the joints of ``gait``, if any."""
    if match.body is None:
        return (), (), (), ()
    turn = 2 * math.pi
    return (
        GAIT_NAMES + TEMPLATE_NAMES,
        (turn * match.phase, match.azimuth, float(match.sequence), float(match.phase_index)),
        (turn * match.phase_rate, 0.0, 0.0, 0.0),
        (match.confidence, match.similarity, match.similarity, match.similarity),
    )


Parts = Mapping[str, Any]
"""The messages about a frame by topic."""

FEEDBACK = ('mask', 'shape_prior', 'matched_box')
"""What the tracker learns from, of each slot."""

_MOST_SENT_TILT = math.pi / 4


def stamp_of(header: Any) -> int:
    """Return the stamp of a header in nanoseconds."""
    return int(header.stamp.sec) * 1_000_000_000 + int(header.stamp.nanosec)


def points_of(message: Any) -> Corners:
    """Return the corners of a box message, 4 or none; an InputError says what is wrong."""
    points = tuple((point.x, point.y) for point in message.polygon.polygon.points)
    if len(points) not in (0, 4):
        raise InputError(f'a box must have 4 points, or none, got {len(points)}')
    if not all(math.isfinite(value) for point in points for value in point):
        raise InputError(f'box points must be finite, got {points}')
    return points


def read_box(message: Any) -> tuple[Box | None, float]:
    """
    Return the box in the frame of the body and the body's tilt in radians, None and 0 of nobody.

    Corners in another order than clockwise from the body's top left make an upright box.

    :raises InputError: see :func:`points_of`; also if the box has no size.
    """
    points = points_of(message)
    if not points:
        return None, 0.0
    body, width = BodyFrame.from_corners(points)
    if abs(body.angle) < _MOST_SENT_TILT:
        return Box.from_center(body.center_x, body.center_y, width, body.height), body.angle
    columns, rows = zip(*points, strict=True)
    left, top = min(columns), min(rows)
    return Box(left, top, max(columns) - left, max(rows) - top), 0.0


def read_body(message: Any) -> BodyFrame | None:
    """Return the body a matched box stands for, None if no person is tracked; see above."""
    points = points_of(message)
    return BodyFrame.from_corners(points)[0] if points else None


def read_gait(message: Any) -> tuple[float, float, float, float]:
    """
    Return what a gait message says; all is 0 if it has no joints.

    A message without efforts does not say how similar the template is: 1 is taken.

    :returns: phase in strides [0, 1), its rate in strides per second, azimuth in radians, and the
        similarity of the matched template with the likelihood, in 0..1.
    :raises InputError: if joints are missing or have no position, or a number is not finite.
    """
    if not message.name:
        return 0.0, 0.0, 0.0, 0.0
    named = dict(zip(message.name, range(len(message.position)), strict=False))
    if not named.keys() >= {*GAIT_NAMES}:
        raise InputError(
            f'gait must have positions of {" and ".join(GAIT_NAMES)}, got {list(message.name)} '
            f'with {len(message.position)} positions'
        )
    phase, azimuth = (named[name] for name in GAIT_NAMES)
    rate = message.velocity[phase] if len(message.velocity) > phase else 0.0
    similarity = message.effort[azimuth] if len(message.effort) > azimuth else 1.0
    numbers = message.position[phase], rate, message.position[azimuth], similarity
    if not all(map(math.isfinite, numbers)):
        raise InputError(f'the numbers of a gait must be finite, got {numbers}')
    turn = 2 * math.pi
    return (numbers[0] / turn) % 1.0, rate / turn, *numbers[2:]


def read_track(parts: Parts, slot: int) -> TrackResult:
    """Put the tracker's messages about a slot together again."""
    message = parts[slot_topic(slot, 'box')]
    box, angle = read_box(message)
    return TrackResult(
        stamp_ns=stamp_of(message.header),
        track_id=int(message.polygon.id),
        box=box,
        likelihood=read_mono8(parts[slot_topic(slot, 'likelihood')]),
        confidence=0.0,
        angle=angle,
    )


def read_match(parts: Parts, slot: int) -> MatchResult:
    """Put together the matcher's messages about a slot, as far as later stages need them."""
    box = parts[slot_topic(slot, 'matched_box')]
    phase, rate, azimuth, similarity = read_gait(parts[slot_topic(slot, 'gait')])
    empty = MatchResult.empty(stamp_of(box.header), int(box.polygon.id), (0, 0))
    prior = parts.get(slot_topic(slot, 'shape_prior'))
    return dataclasses.replace(
        empty,
        body=read_body(box),
        phase=phase,
        phase_rate=rate,
        azimuth=azimuth,
        similarity=similarity,
        shape_prior=empty.shape_prior if prior is None else read_mono8(prior),
    )


def read_feedback(parts: Parts, slot: int) -> Feedback | None:
    """Put the feedback for a slot together, None if it was empty."""
    mask, prior, box = (parts[slot_topic(slot, name)] for name in FEEDBACK)
    track_id, body = int(box.polygon.id), read_body(box)
    if not track_id:
        return None
    return Feedback(stamp_of(box.header), track_id, read_mono8(mask), body, read_mono8(prior))
