# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Hostile messages on the topics of the nodes.

Every field of every message is set to what it may not be; images also show odd things, boxes have
odd corners, and what belongs together comes in part, or as spoilt bytes.
"""

from __future__ import annotations

import math
import struct
from array import array
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import Any

import numpy as np
from geometry_msgs.msg import Point32, PolygonInstanceStamped
from hostile.kinds import Aim, Shot, header, kind
from rclpy.serialization import serialize_message
from sensor_msgs.msg import Image, JointState, RegionOfInterest
from std_msgs.msg import Header

from gait_segmentation.inputs.encodings import ENCODINGS
from gait_segmentation.ros.fields import GAIT_NAMES
from gait_segmentation.ros.messages import image_message
from gait_segmentation.ros.vision import detection_types

__all__ = ['kinds_of_fields']

Change = Callable[[Any], Any]

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
        *('', ' ', '/', 'BGR8', 'bgr8 ', 'mono8', 'mono16', '16UC1', '32FC1', '64FC4', 'h264'),
        *('{0}', '%s%n', "';--", 'a\nb', '\x1b[31mbgr8', 'schwarzweiß', '🙂' * 50, '\u202e'),
        *('png', 'bgr8; jpeg compressed bgr8', '32FC1; compressedDepth', 'a' * 100_000),
    ),
}
"""Values that are odd in a field, by its type."""


def leaves(message: Any) -> Iterator[str]:
    """Go through the fields of a message and of those inside, as paths."""
    for name in message.get_fields_and_field_types():
        value = getattr(message, name)
        inside = value[0] if isinstance(value, list) and value else value
        if hasattr(inside, 'get_fields_and_field_types'):
            yield from (f'{name}.{path}' for path in leaves(inside))
        if inside is not value or not hasattr(value, 'get_fields_and_field_types'):
            yield name


def spoilt(aim: Aim, path: str, message: Any) -> Any:
    """Set a field of a message, in one of each list on its path, to what it should not be."""
    inside = message
    *way, name = path.split('.')
    for step in way:
        inside = getattr(inside, step)
        inside = aim.one_of(inside) if isinstance(inside, list) else inside
    value = getattr(inside, name)
    if isinstance(value, list | array):
        changed = [value[:0], value[:-1], value[:1] * 2, value * (2 if len(value) > 99 else 5000)]
        if isinstance(value, array) and value.typecode == 'd':
            changed += [array('d', [aim.one_of(_EXTREMES['double']) for _ in value])] * 4
        setattr(inside, name, aim.one_of(changed))
    else:
        setattr(inside, name, aim.one_of(_EXTREMES[inside.get_fields_and_field_types()[name]]))
    return message


def kinds_of_fields(
    title: str, sample: Any, send: Callable[[Aim, Change], Iterator[Shot]]
) -> None:
    """
    Enter a kind for each field of a message.

    :param send: makes what is sent, given what changes the message.
    """
    for path in leaves(sample):
        kind(f'{title}: {path}', 0.5)(lambda aim, path=path: send(aim, partial(spoilt, aim, path)))


# On image.


def _encoded(aim: Aim) -> Image:
    """Return noise of any encoding and size that is as its fields say."""
    encoding, (width, height) = aim.one_of(ENCODINGS), aim.size(1, aim.one_of((9, 200)))
    about = ENCODINGS[encoding]
    rows = height + (height + 1) // 2 if about.chroma_rows else height
    step = width * about.channels * about.sample_bytes
    message = Image(header=aim.fresh(), height=height, width=width, encoding=encoding, step=step)
    message.data.frombytes(aim.noise(rows * step).tobytes())
    return message


def _padded(aim: Aim) -> Image:
    width, height = aim.size()
    padded = aim.noise(height + 3, 3 * width + int(aim.rng.integers(1, 70)))
    message = image_message(padded, aim.fresh())
    message.encoding, message.width, message.height = 'bgr8', width, height
    return message


def _claiming(aim: Aim) -> Image:
    """Return an image of no bytes, within the limit of pixels, just beyond, or far."""
    height, width = aim.one_of(((8192, 8192), (8192, 8193), (2**32 - 1,) * 2, (2**32 - 1, 1)))
    return Image(header=aim.fresh(), height=height, width=width, encoding='mono8', step=width)


def _half(aim: Aim) -> np.ndarray:
    image = aim.image.copy()
    image[: aim.rng.integers(image.shape[0])] = aim.one_of((0, 255))
    return image


def _wall(aim: Aim) -> np.ndarray:
    wall = np.full_like(aim.image, 255)
    left = int(aim.rng.integers(60, 120))
    wall[30:150, left : left + 40] = 40
    return wall


_THIN = ((1, 1), (1, 3000), (3000, 1), (2, 2), (3, 500), (15, 15))
_PICTURES: dict[str, Callable[[Aim], np.ndarray]] = {
    'thin': lambda aim: aim.noise(*aim.one_of(_THIN), 3),
    'flat': lambda aim: np.full_like(aim.image, aim.one_of((0, 1, 127, 254, 255))),
    'half saturated': _half,
    'somebody before a flat wall': _wall,
    'the one before': lambda aim: aim.image,
    'checkered': lambda aim: np.indices(aim.image.shape).sum(0).astype(np.uint8) % 2 * 255,
    'noise': lambda aim: aim.noise(*aim.image.shape),
    'another size': lambda aim: aim.noise(*aim.size(16, 640), 3),
}
_IMAGES: dict[str, Callable[[Aim], Image]] = {
    'noise in any encoding': _encoded,
    'padded rows': _padded,
    'sizes claimed': _claiming,
    'stamp of the good frame before': lambda aim: image_message(aim.image, header(aim.stamp_ns)),
} | {
    name: lambda aim, paint=paint: image_message(paint(aim), aim.fresh())
    for name, paint in _PICTURES.items()
}
for _name, _make in _IMAGES.items():
    kind(f'image: {_name}', 0.5)(
        lambda aim, make=_make: (Shot('image', make(aim)) for _ in range(aim.one_of((1, 3))))
    )


# Between the nodes.

Points = Iterable[tuple[float, float]]


def _box(about: Header, points: Points) -> PolygonInstanceStamped:
    message = PolygonInstanceStamped(header=about)
    message.polygon.id = 1
    message.polygon.polygon.points = [Point32(x=float(x), y=float(y)) for x, y in points]
    return message


def _upright(x: float, y: float, width: float, height: float) -> list[tuple[float, float]]:
    return [(x, y), (x + width, y), (x + width, y + height), (x, y + height)]


_FINE = _upright(90.0, 40.0, 45.0, 120.0)
_CORNERS: dict[str, Points] = {
    'of 10^6 px': _upright(10, 10, 1e6, 1e6),
    'of 10^12 px height': _upright(10, 10, 50, 1e12),
    'of the largest floats': _upright(-3e38, -3e38, 3.4e38, 3.4e38),
    'far away': _upright(3e30, -900, 60, 150),
    'turned inside out': _upright(180, 190, -60, -150),
    'without area': [(5.0, 5.0)] * 4,
    'a line': _upright(10, 10, 0, 90),
    'of 10^-30 px': _upright(10, 10, 1e-30, 1e-30),
    'crossed': [_FINE[0], _FINE[2], _FINE[1], _FINE[3]],
}
"""Corners of a box, by what is wrong with them."""


def _grey(aim: Aim, about: Header, size: tuple[int, int] | None = None) -> Image:
    """Return a likelihood, mask or prior of somebody in the middle."""
    columns, rows = size or aim.image.shape[1::-1]
    image = np.full((rows, columns), 10, np.uint8)
    image[rows // 5 : -rows // 5 or None, columns // 3 : -columns // 3 or None] = 250
    return image_message(image, about)


def _odd(aim: Aim, about: Header) -> Image:
    """Return noise, something flat or coloured, or an image of another size."""
    shape, sizes = aim.image.shape[:2], ((1, 1), (1, 700), (700, 1), (640, 480), aim.size())
    flat = np.full(shape, aim.one_of((0, 255)), np.uint8)
    pixels = aim.one_of((aim.noise(*shape), flat, aim.image))
    return aim.one_of((image_message(pixels, about), _grey(aim, about, aim.one_of(sizes))))


_BOXES = ('box', 'matched_box')


def _part(name: str, aim: Aim, about: Header) -> Any:
    """Return a good message for a topic of a person."""
    if name in _BOXES:
        return _box(about, _FINE)
    if name == 'gait':
        fields = {'position': [1.0, 0.0], 'velocity': [6.0, 0.0], 'effort': [0.9, 0.7]}
        return JointState(header=about, name=list(GAIT_NAMES), **fields)
    return _grey(aim, about)


_SETS = {
    'matcher': ('box', 'likelihood'),
    'segmenter': ('likelihood', 'matched_box', 'shape_prior', 'gait'),
    'feedback': ('mask', 'shape_prior', 'matched_box'),
}
"""The topics of a person that a node joins."""


def _send_set(
    target: str, aim: Aim, name: str = '', change: Change | None = None
) -> Iterator[Shot]:
    """Send all that a node joins, one of it changed."""
    # Only of a frame that it has seen does the tracker learn.
    about = header(aim.stamp_ns) if target == 'feedback' else aim.fresh()
    stamp_ns = about.stamp.sec * 10**9 + about.stamp.nanosec
    for each in _SETS[target]:
        part = _part(each, aim, header(stamp_ns))
        yield Shot(f'person_0/{each}', change(part) if change and each == name else part)
    if target == 'segmenter':
        # Last, so that nothing of this frame comes from the other nodes before.
        yield Shot('image', image_message(aim.image, about))


def _alone(target: str, aim: Aim) -> Iterator[Shot]:
    yield aim.one_of(_send_set(target, aim))


def _misdated(target: str, aim: Aim) -> Iterator[Shot]:
    about = header(aim.one_of(_EXTREMES['int32']) * 10**9 + 5)
    for shot in _send_set(target, aim):
        if shot.topic != 'image':
            shot.message.header = about
        yield shot


_blank = Aim(np.random.default_rng(0), [np.zeros((9, 9, 3), np.uint8)])
for _target, _names in _SETS.items():
    kind(f'{_target}: parts of a set alone')(partial(_alone, _target))
    kind(f'{_target}: set with an odd stamp')(partial(_misdated, _target))
    for _name in _names:
        kinds_of_fields(
            f'{_target}: {_name}',
            _part(_name, _blank, Header()),
            lambda aim, change, target=_target, name=_name: _send_set(target, aim, name, change),
        )
        for _how, _points in _CORNERS.items() if _name in _BOXES else ():
            kind(f'{_target}: {_name} {_how}', 0.6)(
                lambda aim, target=_target, name=_name, points=_points: _send_set(
                    target, aim, name, lambda part: _box(part.header, points)
                )
            )
        if _name not in ('gait', *_BOXES):
            kind(f'{_target}: odd {_name}', 2.0)(
                lambda aim, target=_target, name=_name: _send_set(
                    target, aim, name, lambda part: _odd(aim, part.header)
                )
            )


# Starts of tracks, and the size of the images.


def _region(aim: Aim) -> RegionOfInterest:
    left, top = aim.size(0, 60)
    return RegionOfInterest(x_offset=60 + left, y_offset=top, width=45, height=110)


@kind('init_roi: flood', 0.1)
def _flood(aim: Aim) -> Iterator[Shot]:
    yield from (Shot('init_roi', _region(aim)) for _ in range(100))


def _sized(aim: Aim, change: Change) -> Iterator[Shot]:
    height, width = aim.image.shape[:2]
    yield Shot('image_size', change(RegionOfInterest(width=width, height=height)))
    yield from _send_set('matcher', aim)
    # The tracker says it again only when it changes.
    yield Shot('image_size', RegionOfInterest(width=width, height=height))


def _detections(types: Any, aim: Aim) -> Any:
    about = types.ObjectHypothesis(class_id='person', score=0.9)
    bounds = types.BoundingBox2D(size_x=45.0, size_y=120.0)
    bounds.center.position.x, bounds.center.position.y = 110.0, 100.0
    found = types.Detection2D(
        results=[types.ObjectHypothesisWithPose(hypothesis=about)], bbox=bounds
    )
    return types.Detection2DArray(header=aim.fresh(), detections=[found])


_ALONE: dict[str, Callable[[Aim], Any]] = {
    'image': lambda aim: image_message(aim.image, aim.fresh()),
    'init_roi': _region,
}
if (_types := detection_types()) is not None:
    _ALONE['detections'] = partial(_detections, _types)
for _topic, _make in _ALONE.items():
    kinds_of_fields(
        _topic,
        _make(_blank),
        lambda aim, change, topic=_topic, make=_make: iter([Shot(topic, change(make(aim)))]),
    )
kinds_of_fields('image_size', RegionOfInterest(), _sized)


# As no publisher of ROS makes them.  Seldom, since Fast DDS prints a line of each that it cannot
# read.


@kind('bytes: cut off or changed', 0.75)
def _damaged(aim: Aim) -> Iterator[Shot]:
    shot = aim.one_of(_send_set(aim.one_of(_SETS), aim))
    data = serialize_message(shot.message)
    # Behind what says how the rest is to be read.
    yield Shot(shot.topic, aim.one_of((aim.cut(data), aim.some_changed(data, 4, 64))))


@kind('bytes: a frame_id that is no UTF-8')
def _no_utf8(aim: Aim) -> Iterator[Shot]:
    data = serialize_message(image_message(aim.image, aim.fresh()))
    yield Shot('image', data.replace(b'bad\0', b'\xff\xfe\xc3\0', 1))


@kind('bytes: data of 4 GB announced', 0.25)
def _announced(aim: Aim) -> Iterator[Shot]:
    data = serialize_message(image_message(aim.noise(4, 4), aim.fresh()))
    yield Shot('image', data.replace(struct.pack('<I', 16), struct.pack('<I', 2**32 - 1), 1))
