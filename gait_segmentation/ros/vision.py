# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
People as detections (vision_msgs), for those who have that package.

Detection2DArray on ``detections`` starts tracks, and what is tracked goes out on ``tracks``.
Fields as vision_msgs defines them since ROS 2 Humble.
"""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from gait_segmentation.errors import InputError
from gait_segmentation.geometry import Box
from gait_segmentation.ros.config import DetectionConfig

if TYPE_CHECKING:
    from gait_segmentation.results import TrackResult

__all__ = ['detection_types', 'detections_message', 'new_people', 'read_detections']

_SAME_OVERLAP = 0.3
"""Intersection over union from which two boxes are taken for the same person."""


def detection_types() -> Any:
    """Return the module of the message types, None if vision_msgs is not installed."""
    try:
        return importlib.import_module('vision_msgs.msg')
    except ImportError:
        return None


def detections_message(tracks: Sequence[TrackResult], header: Any, types: Any) -> Any:
    """
    Describe everybody who is seen.

    ``id`` is the track id, ``score`` the confidence of the track, ``class_id`` is ``person`` and
    ``theta`` the tilt of the box in radians, positive with the head to the right.
    """
    detections = []
    for track in tracks:
        if track.box is None:
            continue
        box = track.box
        center = types.Pose2D(
            position=types.Point2D(x=float(box.center_x), y=float(box.center_y)),
            theta=float(track.angle),
        )
        about = types.ObjectHypothesis(class_id='person', score=float(track.confidence))
        bounds = types.BoundingBox2D(
            center=center, size_x=float(box.width), size_y=float(box.height)
        )
        results = [types.ObjectHypothesisWithPose(hypothesis=about)]
        detections.append(
            types.Detection2D(header=header, results=results, bbox=bounds, id=str(track.track_id))
        )
    return types.Detection2DArray(header=header, detections=detections)


def read_detections(message: Any, config: DetectionConfig) -> list[Box]:
    """
    Return the boxes of the people in a message, the surest first.

    Detections of another class, with too small a score or without a size are left out; so is the
    turn of a box.
    """
    found = []
    for detection in message.detections:
        scores = [
            float(result.hypothesis.score)
            for result in detection.results
            if config.detection_class in ('', result.hypothesis.class_id)
        ]
        if not scores or max(scores) < config.detection_score:
            continue
        center, box = detection.bbox.center.position, detection.bbox
        try:
            sides = (float(box.size_x), float(box.size_y))
            found.append((max(scores), Box.from_center(float(center.x), float(center.y), *sides)))
        except InputError:
            continue
    return [box for _, box in sorted(found, key=lambda each: -each[0])]


def new_people(
    boxes: Sequence[Box],
    tracks: Sequence[TrackResult],
    slots: int,
    requested: Sequence[Box] = (),
) -> list[Box]:
    """
    Return the boxes to start tracks from: of people who are not tracked, for slots that are free.

    A detector sees the tracked people in every frame; they must not be started anew.

    :param requested: boxes that tracks are about to start from.
    """
    known = [*requested, *(track.box for track in tracks if track.box is not None)]
    free = slots - len(requested) - sum(track.track_id != 0 for track in tracks)
    new: list[Box] = []
    for box in boxes:
        if len(new) >= free:
            break
        if all(box.iou(each) < _SAME_OVERLAP for each in (*known, *new)):
            new.append(box)
    return new
