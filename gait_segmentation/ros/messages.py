# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
What the nodes publish: messages of images, boxes, gait, places and people, and on which topics.

A message without subscribers is not made: of a frame's it would take a millisecond.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import cv2
import numpy as np
from geometry_msgs.msg import (
    Point,
    Point32,
    PolygonInstanceStamped,
    Pose,
    PoseWithCovarianceStamped,
    Quaternion,
    Vector3,
)
from numpy.typing import NDArray
from sensor_msgs.msg import CompressedImage, Image, JointState
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from gait_segmentation.drawing import track_colour
from gait_segmentation.geometry import Box
from gait_segmentation.streams.fields import (
    Corners,
    gait_joints,
    matched_corners,
    refined_corners,
    slot_topic,
    track_corners,
)

if TYPE_CHECKING:
    from gait_segmentation.localization import Location
    from gait_segmentation.results import MatchResult, TrackResult


_UPRIGHT = 1e-4
"""Variance of how upright a pose is, which it is by definition: readers may invert it."""


class Person(NamedTuple):
    """A person in a frame: the match, the tight box of the mask, and the location if known."""

    match: MatchResult
    box: Box
    location: Location | None


def image_message(image: NDArray[np.uint8], header: Header) -> Image:
    """Make a message from an array, (height, width) for mono8 or (height, width, 3) for bgr8."""
    message = Image()
    message.header = header
    message.height, message.width = image.shape[:2]
    message.encoding = 'mono8' if image.ndim == 2 else 'bgr8'
    message.step = message.width * (1 if image.ndim == 2 else 3)
    message.is_bigendian = int(sys.byteorder == 'big')
    # The only fast way: assigning an array, bytes or a memoryview checks every element.
    if image.size:
        message.data.frombytes(np.ascontiguousarray(image).data.cast('B'))
    return message


def compressed_message(image: NDArray[np.uint8], header: Header) -> CompressedImage:
    """Make a message of a JPEG from a picture, empty without pixels."""
    message = CompressedImage(header=header, format='bgr8; jpeg compressed bgr8')
    if image.size:
        message.data.frombytes(cv2.imencode('.jpg', image)[1].data.cast('B'))
    return message


def box_message(corners: Corners, track_id: int, header: Header) -> PolygonInstanceStamped:
    """Make a message from corners in source pixels, none if no person is tracked."""
    message = PolygonInstanceStamped(header=header)
    message.polygon.id = track_id
    message.polygon.polygon.points = [Point32(x=float(x), y=float(y)) for x, y in corners]
    return message


def gait_message(match: MatchResult, header: Header) -> JointState:
    """Make the gait message of a match; it has no joints if no person is tracked."""
    message = JointState(header=header)
    joints = map(list, gait_joints(match))
    message.name, message.position, message.velocity, message.effort = joints
    return message


def pose_message(location: Location, header: Header) -> PoseWithCovarianceStamped:
    """Describe the point on the ground below a person; x is the heading and z up."""
    message = PoseWithCovarianceStamped(header=header)
    message.pose.pose = _pose(location)
    covariance = np.zeros((6, 6))
    covariance[:3, :3] = location.covariance
    turn = location.heading_error**2 * np.outer(location.up, location.up)
    covariance[3:, 3:] = turn + _UPRIGHT * np.eye(3)
    message.pose.covariance = covariance.ravel()
    return message


def walk_message(location: Location, header: Header) -> JointState:
    """Describe heading, speed and step length, as far as they are known."""
    values = _walk(location)
    return JointState(header=header, name=[*values], position=[*values.values()])


def detection_types() -> Any:
    """Return the module of the message types, None if vision_msgs is not installed."""
    try:
        return importlib.import_module('vision_msgs.msg')
    except ImportError:
        return None


def tracks_message(tracks: Sequence[TrackResult], header: Header, types: Any) -> Any:
    """
    Describe all tracks that are seen (vision_msgs/Detection2DArray).

    ``id`` is the track id, ``score`` the confidence of the track, ``class_id`` is ``person`` and
    ``theta`` the tilt of the box in radians, positive with the head to the right.
    """
    found = []
    for track in tracks:
        if track.box is not None:
            sure = {'person': track.confidence}
            found.append(_detection(track.box, track.angle, track.track_id, sure, header, types))
    return types.Detection2DArray(header=header, detections=found)


def people_message(people: Sequence[Person], header: Header, types: Any) -> Any:
    """
    Describe all people in pixels (vision_msgs/Detection2DArray).

    ``id`` is the track id and ``bbox`` the tight box of the mask.  ``results`` are numbers by
    name: ``class_id`` names what ``score`` is, first ``person``, how similar the template is.
    """
    found = []
    for match, box, location in people:
        numbers = {
            'person': match.similarity,
            'phase': match.phase,
            'cadence': match.phase_rate,
            'view_azimuth': match.azimuth,
            **({} if location is None else _walk(location)),
        }
        each = _detection(box, 0.0, match.track_id, numbers, header, types)
        if location is not None:
            each.results[0].pose = pose_message(location, header).pose
        found.append(each)
    return types.Detection2DArray(header=header, detections=found)


def markers_message(people: Sequence[Person], header: Header) -> MarkerArray:
    """Draw all whose place is known: a body, an arrow ahead, and what is known in words."""
    markers = [Marker(header=header, action=Marker.DELETEALL)]
    for match, _, location in people:
        if location is None:
            continue
        tall = location.stature
        about = [f'{match.track_id}', f'{location.distance:.1f} m']
        if location.speed is not None:
            about.append(f'{location.speed:.1f} m/s')
        shapes = (
            ('body', Marker.CYLINDER, tall / 2, (0.5, 0.5, tall), 0.5),
            ('heading', Marker.ARROW, tall / 2, (1.0, 0.1, 0.1), 1.0),
            ('about', Marker.TEXT_VIEW_FACING, tall + 0.2, (0.2, 0.2, 0.2), 1.0),
        )
        for name, kind, up, size, opacity in shapes:
            marker = Marker(header=header, ns=name, id=match.track_id, type=kind)
            marker.pose, marker.text = _pose(location, up), '  '.join(about)
            marker.scale = Vector3(**dict(zip('xyz', map(float, size), strict=True)))
            marker.color = _colour(match.track_id, opacity)
            markers.append(marker)
    return MarkerArray(markers=markers)


def _walk(location: Location) -> dict[str, float]:
    names = {'heading': 'yaw', 'speed': 'speed', 'step_length': 'step_length'}
    known = {name: getattr(location, field) for name, field in names.items()}
    return {name: float(value) for name, value in known.items() if value is not None}


def _detection(
    box: Box, angle: float, track_id: int, numbers: Mapping[str, float], header: Header, types: Any
) -> Any:
    center = types.Point2D(x=float(box.center_x), y=float(box.center_y))
    bounds = types.BoundingBox2D(
        center=types.Pose2D(position=center, theta=float(angle)),
        size_x=float(box.width),
        size_y=float(box.height),
    )
    results = []
    for name, value in numbers.items():
        guess = types.ObjectHypothesis(class_id=name, score=float(value))
        results.append(types.ObjectHypothesisWithPose(hypothesis=guess))
    return types.Detection2D(header=header, results=results, bbox=bounds, id=str(track_id))


def _pose(location: Location, up: float = 0.0) -> Pose:
    """Return a pose above the point on the ground; x is the heading and z up."""
    x, y, z = (location.position + up * location.up).tolist()
    turn = dict(zip('xyzw', location.orientation, strict=True))
    return Pose(position=Point(x=x, y=y, z=z), orientation=Quaternion(**turn))


def _colour(track_id: int, opacity: float) -> ColorRGBA:
    blue, green, red = (float(value) / 255 for value in track_colour(track_id))
    return ColorRGBA(r=red, g=green, b=blue, a=opacity)


Table = dict[str, tuple[Any, Callable[[Any, Any], Any]]]

_IMAGES: Mapping[Any, Callable[..., Any]] = {
    Image: image_message,
    CompressedImage: compressed_message,
}


class Outputs:
    """The publishers of a table, of which those are served that are listened to."""

    def __init__(self, node: Any, table: Table) -> None:
        """Make the publishers of a :class:`GaitNode`."""
        self._topics = [
            (kind, make, node.output(kind, topic)) for topic, (kind, make) in table.items()
        ]

    def publish(self, result: Any, header: Header) -> None:
        """Publish the messages of a result, but for those of which nothing is known."""
        for _, make, publisher in self._topics:
            if publisher.get_subscription_count():
                message = make(result, header)
                if message is not None:
                    publisher.publish(message)

    def publish_made(self, header: Header, make: Callable[..., Any], *about: Any) -> None:
        """Make a result and publish its messages, if there are subscribers."""
        if any(publisher.get_subscription_count() for _, _, publisher in self._topics):
            self.publish(make(*about), header)

    def blank(self, shape: tuple[int, ...], header: Header) -> None:
        """Publish empty results; ``shape`` is that of the images, which are one message."""
        black: dict[Any, Any] = {}
        for kind, _, publisher in self._topics:
            if not publisher.get_subscription_count():
                continue
            if kind in _IMAGES and kind not in black:
                black[kind] = _IMAGES[kind](np.zeros(shape, np.uint8), header)
            publisher.publish(black.get(kind) or kind(header=header))


def track_topics(slots: int) -> Table:
    """Return the outputs of the tracks of all slots."""
    table = _of_slots(
        slots,
        {
            'box': _boxes(track_corners),
            'likelihood': (Image, lambda track, header: image_message(track.likelihood, header)),
        },
    )
    if types := detection_types():
        table['tracks'] = (types.Detection2DArray, partial(tracks_message, types=types))
    return table


def match_topics(slots: int) -> Table:
    """Return the outputs of the matches of all slots."""
    return _of_slots(
        slots,
        {
            'matched_box': _boxes(matched_corners),
            'refined_box': _boxes(refined_corners),
            'gait': (JointState, gait_message),
            'shape_prior': (Image, lambda match, header: image_message(match.shape_prior, header)),
        },
    )


def mask_topics(slots: int) -> Table:
    """Return the outputs of :class:`PeopleMasks`, first what most listen to."""
    own: Table = {'mask': (Image, lambda found, header: image_message(found.mask, header))}
    return {
        **own,
        **_of_slots(slots, own, lambda masks, slot: masks.people[slot]),
        'labels': (Image, lambda masks, header: image_message(masks.labels, header)),
    }


def picture_topics() -> Table:
    """Return the outputs of a picture for people, (H, W, 3) uint8 BGR."""
    return {
        'debug_image': (Image, image_message),
        'debug_image/compressed': (CompressedImage, compressed_message),
    }


def people_topics(slots: int) -> Table:
    """Return the outputs of what :func:`seen` returns: places, and all people in one message."""
    table = _of_slots(
        slots,
        {'pose': (PoseWithCovarianceStamped, pose_message), 'walk': (JointState, walk_message)},
        lambda found, slot: found[1][slot],
    )
    table['markers'] = MarkerArray, lambda found, header: markers_message(found[0], header)
    if types := detection_types():
        table['people'] = (
            types.Detection2DArray,
            lambda found, header: people_message(found[0], header, types),
        )
    return table


def seen(
    matches: Sequence[MatchResult],
    masks: Sequence[NDArray[np.uint8]],
    locations: Sequence[Location | None],
) -> tuple[Sequence[Person], Sequence[Location | None]]:
    """Return who is seen in a frame, and the place of each slot as far as it is known."""
    people = [
        Person(match, box, location)
        for match, mask, location in zip(matches, masks, locations, strict=True)
        if match.body is not None and (box := Box.around(mask)) is not None
    ]
    return people, locations


def _of_slots(
    slots: int,
    table: Table,
    choose: Callable[[Any, int], Any] = lambda results, slot: results[slot],
) -> Table:
    """Return the outputs of all slots; ``choose`` returns what is known of one, perhaps None."""

    def of_slot(make: Callable[..., Any], slot: int, results: Any, header: Header) -> Any:
        result = choose(results, slot)
        return None if result is None else make(result, header)

    return {
        slot_topic(slot, name): (kind, partial(of_slot, make, slot))
        for slot in range(slots)
        for name, (kind, make) in table.items()
    }


def _boxes(corners: Callable[[Any], Corners]) -> tuple[Any, Callable[[Any, Any], Any]]:
    """Return the output of the box that a track or match has these corners of."""
    return PolygonInstanceStamped, lambda result, header: box_message(
        corners(result), result.track_id, header
    )
