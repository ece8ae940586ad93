# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Good messages and requests for the nodes, and how they are spoilt.

What a node takes at a time is a *set* of messages; one of them is spoilt: a field is set to what
it may not be, its picture or corners are odd, its bytes are, or the others do not come.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable, Iterator
from random import Random
from typing import Any, NamedTuple

import cv2
import numpy as np
from geometry_msgs.msg import Point32, PolygonInstanceStamped
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import DescribeParameters, SetParameters
from rclpy.serialization import serialize_message
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, JointState, RegionOfInterest
from std_msgs.msg import Header
from std_srvs.srv import SetBool, Trigger

from benchmarks.fuzzing import CHANGES
from benchmarks.running_nodes import STYLES
from gait_segmentation.inputs.encodings import ENCODINGS
from gait_segmentation.ros.messages import detection_types, image_message
from gait_segmentation.streams.fields import GAIT_NAMES

SPACES = {
    **STYLES,
    'split': (*STYLES['split'], 'gait_localizer'),
}
"""The nodes, by the namespace they are in."""

NODES = [name for names in SPACES.values() for name in names]

DETECTIONS = detection_types()

KINDS: dict[str, Any] = {
    'image': Image,
    'image/compressed': CompressedImage,
    'init_roi': RegionOfInterest,
    **({} if DETECTIONS is None else {'detections': DETECTIONS.Detection2DArray}),
    'heat_map': Image,
    'camera_info': CameraInfo,
    'depth': Image,
    'image_size': RegionOfInterest,
    'person_0/box': PolygonInstanceStamped,
    'person_0/likelihood': Image,
    'person_0/matched_box': PolygonInstanceStamped,
    'person_0/shape_prior': Image,
    'person_0/gait': JointState,
    'person_0/mask': Image,
}
"""Types of all topics that the nodes read."""

SETS = {
    **{topic: (topic,) for topic in list(KINDS)[:-7]},
    'image size': ('image_size', 'person_0/box', 'person_0/likelihood'),
    'matcher': ('person_0/box', 'person_0/likelihood'),
    # The image last, so that nothing of this frame comes from the other nodes before.
    'segmenter': (
        *('person_0/likelihood', 'person_0/matched_box', 'person_0/shape_prior', 'person_0/gait'),
        'image',
    ),
    'feedback': ('person_0/mask', 'person_0/shape_prior', 'person_0/matched_box'),
    'localizer': (
        'camera_info',
        'depth',
        'person_0/matched_box',
        'person_0/gait',
        'person_0/mask',
    ),
}
"""What goes together."""

SERVICES = {
    'set_parameters': SetParameters,
    'describe_parameters': DescribeParameters,
    'enable': SetBool,
    'reset': Trigger,
    'change_state': ChangeState,
}

_FLOATS = (math.nan, math.inf, -math.inf, 0.0, -1.0, 0.7, 1e-30, 60.0, 1e7, 3e38)
_EXTREMES: dict[str, tuple[Any, ...]] = {
    'boolean': (True, False),
    'uint8': (0, 1, 77, 255),
    'int32': (0, -1, -5, 500, -(2**31), 2**31 - 1),
    'uint32': (0, 1, 3, 7, 320, 4000, 8192, 65_536, 2**31, 2**32 - 1),
    'int64': (0, -1, 2**31, 2**63 - 1, -(2**63)),
    'uint64': (0, 1, 2**63),
    'float': _FLOATS,
    'double': (*_FLOATS, 1e300, -1e300),
    'string': (
        *('', '/', 'BGR8', 'mono16', '16UC1', '32FC1', 'h264', '{0}', '%s%n', 'a\nb', '\x1b[31m'),
        *('schwarzweiß', '🙂' * 50, '\u202e', '32FC1; compressedDepth', 'a' * 100_000),
        *ENCODINGS,
    ),
}
"""Values that are odd in a field, by its type."""

_NAMES = ('backlog', 'autostart', 'max_people', 'initial_box', 'bank', 'tracking.working_height',
          'matching.window', 'segmentation.prior', 'starting.auto_init', 'no_such', '', '.',
          'a' * 10_000, 'tracking', 'matching.window.x')  # fmt: skip
_VALUES = (
    ParameterValue(),
    *(ParameterValue(type=2, integer_value=value) for value in _EXTREMES['int64']),
    *(ParameterValue(type=3, double_value=value) for value in _FLOATS[:3]),
    *(ParameterValue(type=4, string_value=value) for value in ('magic', 'x' * 20_000)),
    ParameterValue(type=7, integer_array_value=[2**40] * 9),
    ParameterValue(type=8, double_array_value=[math.nan] * 4),
    *(ParameterValue(type=number) for number in (10, 77, 255)),
)
"""None of which any parameter takes."""


class Shot(NamedTuple):
    """A message, or the bytes of one as DDS has them, for a topic of the nodes."""

    topic: str
    message: Any


class Call(NamedTuple):
    """
    A request to a service of a node, which may take no frames before the next one.

    One that rclpy raises an error for is not answered, but must not end the node.
    """

    node: str
    service: str
    request: Any
    pauses: bool = False
    answered: bool = True


def header(stamp_ns: int, frame_id: str) -> Header:
    """Return a header with a stamp."""
    made = Header(frame_id=frame_id)
    made.stamp.sec, made.stamp.nanosec = divmod(stamp_ns, 1_000_000_000)
    return made


def good(topic: str, image: np.ndarray, about: Header) -> Any:
    """Return a good message of somebody in the middle of an image."""
    rows, columns = image.shape[:2]
    if topic == 'image':
        return image_message(image, about)
    if topic == 'image/compressed':
        message = CompressedImage(header=about, format='jpeg')
        message.data.frombytes(cv2.imencode('.jpg', image)[1].tobytes())
        return message
    if topic == 'image_size':
        return RegionOfInterest(width=columns, height=rows)
    if topic == 'init_roi':
        return RegionOfInterest(x_offset=columns // 3, y_offset=20, width=45, height=110)
    if topic == 'detections':
        guess = DETECTIONS.ObjectHypothesis(class_id='person', score=0.9)
        bounds = DETECTIONS.BoundingBox2D(size_x=45.0, size_y=120.0)
        bounds.center.position.x, bounds.center.position.y = 110.0, 100.0
        results = [DETECTIONS.ObjectHypothesisWithPose(hypothesis=guess)]
        found = [DETECTIONS.Detection2D(results=results, bbox=bounds)]
        return DETECTIONS.Detection2DArray(header=about, detections=found)
    if topic == 'person_0/gait':
        fields = {'position': [1.0, 0.0], 'velocity': [6.0, 0.0], 'effort': [0.9, 0.7]}
        return JointState(header=about, name=list(GAIT_NAMES), **fields)
    if topic == 'camera_info':
        k = [200.0, 0.0, columns / 2, 0.0, 200.0, rows / 2, 0.0, 0.0, 1.0]
        return CameraInfo(header=about, width=columns, height=rows, k=k)
    if topic == 'depth' or (topic == 'heat_map' and about.stamp.nanosec % 2):
        return _floats(np.full((rows, columns), 4.0 if topic == 'depth' else 0.5), about)
    if topic.endswith('box'):
        return _box([(90.0, 40.0), (135.0, 40.0), (135.0, 160.0), (90.0, 160.0)], about)
    grey = np.full((rows, columns), 10, np.uint8)
    grey[rows // 5 : -rows // 5 or None, columns // 3 : -columns // 3 or None] = 250
    return image_message(grey, about)


def _floats(values: np.ndarray, about: Header) -> Image:
    message = Image(header=about, encoding='32FC1', step=4 * values.shape[1])
    message.height, message.width = values.shape
    message.data.frombytes(values.astype('<f4').tobytes())
    return message


def _box(corners: list[tuple[float, float]], about: Header) -> PolygonInstanceStamped:
    message = PolygonInstanceStamped(header=about)
    message.polygon.id = 1
    message.polygon.polygon.points = [Point32(x=x, y=y) for x, y in corners]
    return message


def _leaves(message: Any) -> Iterator[tuple[Any, str]]:
    """Go through the fields of a message, and of those inside, with what they are fields of."""
    for name in message.get_fields_and_field_types():
        value = getattr(message, name)
        for inside in value[:4] if isinstance(value, list) else [value]:
            if hasattr(inside, 'get_fields_and_field_types'):
                yield from _leaves(inside)
        if not hasattr(value, 'get_fields_and_field_types'):
            yield message, name


def _field(rng: Random, message: Any) -> Any:
    """Set a field to what it should not be."""
    inside, name = rng.choice(list(_leaves(message)))
    value = getattr(inside, name)
    if isinstance(value, list | array):
        changed = [value[:0], value[:-1], value[:1] * 2, value * (2 if len(value) > 99 else 5000)]
        if isinstance(value, array) and value.typecode == 'd':
            changed += [array('d', [rng.choice(_EXTREMES['double']) for _ in value])] * 4
        setattr(inside, name, rng.choice(changed))
    elif isinstance(value, np.ndarray):
        # Of a length that the type has.
        value[rng.randrange(len(value))] = rng.choice(_EXTREMES['double'])
    else:
        setattr(inside, name, rng.choice(_EXTREMES[inside.get_fields_and_field_types()[name]]))
    return message


def _content(rng: Random, message: Any) -> Any:
    """Return odd corners, an odd picture of any size, or another field."""
    noise = np.random.default_rng(rng.randrange(1 << 30))
    if isinstance(message, PolygonInstanceStamped):
        left, top, right, bottom = (rng.choice((*_FLOATS[3:], -900.0, 180.0)) for _ in range(4))
        return _box([(left, top), (right, top), (right, bottom), (left, bottom)], message.header)
    if isinstance(message, CompressedImage):
        shape = rng.choice([(1, 1), (1, 900), (900, 1), (64, 64)])
        data = cv2.imencode(
            rng.choice(['.jpg', '.png', '.webp', '.bmp', '.tiff', '.ppm']),
            noise.integers(0, 256, (*shape, 3), np.uint8),
        )[1].tobytes()
        # Headers that claim what does not come are among the changes.
        message.data = array('B', rng.choice(list(CHANGES.values()))(rng, data))
        return message
    if not isinstance(message, Image):
        return _field(rng, message)
    thin = rng.choice([(1, 1), (1, 3000), (3000, 1), (2, 2), (3, 500), (15, 15), (480, 640)])
    size = rng.choice([thin, (message.height, message.width)])
    colour = rng.choice([message.encoding == 'bgr8'] * 9 + [message.encoding != 'bgr8'])
    form = (*size, 3) if colour else size
    flat = np.full(form, rng.choice((0, 1, 127, 254, 255)), np.uint8)
    checks = np.indices(form).sum(0).astype(np.uint8) % 2 * np.uint8(255)
    picture = rng.choice([flat, checks, noise.integers(0, 256, form, np.uint8)])
    return image_message(picture, message.header)


def _bytes(rng: Random, message: Any) -> bytes:
    """Spoil the bytes behind what says how they are to be read."""
    data = serialize_message(message)
    return data[:4] + rng.choice([CHANGES['flip'], CHANGES['truncate']])(rng, data[4:])


_WAYS: dict[str, tuple[Callable[[Random, Any], Any], int]] = {
    'field': (_field, 6),
    'content': (_content, 6),
    # Seldom: Fast DDS prints a line of each that it cannot read.
    'bytes': (_bytes, 1),
    'alone': (lambda rng, message: message, 1),
}


def shots(name: str, rng: Random, image: np.ndarray, about: Header) -> tuple[str, list[Shot]]:
    """
    Return how a set is spoilt, in words, and its messages.

    :param name: of the set.
    :param image: (h, w, 3) uint8 BGR, what the camera sees.
    """
    topics = SETS[name]
    way = rng.choices(list(_WAYS), [weight for _, weight in _WAYS.values()])[0]
    at = rng.choice(topics)

    def made(topic: str) -> Any:
        return good(topic, image, Header(stamp=about.stamp, frame_id=about.frame_id))

    found = [
        Shot(topic, _WAYS[way][0](rng, made(topic)) if topic == at else made(topic))
        for topic in topics
        if way != 'alone' or topic == at
    ]
    if topics[0] == 'image_size':
        # The tracker says it again only when it changes.
        found.append(Shot('image_size', made('image_size')))
    return f'{name}: {way}', found


def calls(rng: Random) -> tuple[str, list[Call]]:
    """Return what is asked of a node, in words, and the requests."""
    node, what = rng.choice(NODES), rng.choice(('set', 'ask', 'enable', 'reset', 'state'))
    if what == 'set':
        count = rng.choice((0, 1, 1, 1, 4, 200))
        given = [
            Parameter(name=rng.choice(_NAMES), value=rng.choice(_VALUES)) for _ in range(count)
        ]
        request = SetParameters.Request(parameters=given)
        known = all(each.value.type <= ParameterType.PARAMETER_STRING_ARRAY for each in given)
        return what, [Call(node, 'set_parameters', request, answered=known)]
    if what == 'ask':
        names = rng.choices(_NAMES, k=rng.choice((0, 1, 30)))
        return what, [Call(node, 'describe_parameters', DescribeParameters.Request(names=names))]
    if what == 'enable':
        return what, [Call(node, what, SetBool.Request(data=on), True) for on in (False, True)]
    if what == 'reset':
        return what, [Call(node, what, Trigger.Request())]
    cycle = rng.choice([(4, 3), (4, 2, 1, 3)]) if rng.random() < 0.05 else None
    label = '' if cycle else rng.choice(('', 'magic', 'a' * 10_000))
    # Deactivated and active again, configured anew; else transitions that there are not.
    return what, [
        Call(
            node,
            'change_state',
            ChangeState.Request(transition=Transition(id=number, label=label)),
            cycle is not None,
            cycle is not None,
        )
        for number in cycle or (rng.choice((0, 1, 2, 3, 9, 10, 30, 61, 255)),)
    ]
