# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Hostile messages on the topics between the nodes, and on those that start tracks."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from hostile.images import LIARS
from hostile.kinds import Aim, Shot, box, header, kind
from sensor_msgs.msg import JointState, RegionOfInterest
from std_msgs.msg import Header

from gait_segmentation.ros.fields import GAIT_NAMES
from gait_segmentation.ros.image import image_message
from gait_segmentation.ros.vision import detection_types

__all__ = ['BOXES', 'GAITS']

Points = list[tuple[float, float]]


def _upright(x: float, y: float, width: float, height: float) -> Points:
    return [(x, y), (x + width, y), (x + width, y + height), (x, y + height)]


_FINE = _upright(90.0, 40.0, 45.0, 120.0)

BOXES: dict[str, Callable[[Aim], tuple[Points, int]]] = {
    'NaN': lambda aim: ([(math.nan, 1.0), *_FINE[1:]], 1),
    'infinite': lambda aim: ([*_FINE[:3], (1.0, math.inf)], 1),
    'of 10^6 px': lambda aim: (_upright(10, 10, 1e6, 1e6), 1),
    'of 10^7 px': lambda aim: (_upright(10, 10, 1e7, 1e7), 1),
    'of 10^12 px height': lambda aim: (_upright(10, 10, 50, 1e12), 1),
    'far away': lambda aim: (_upright(3e30, 20, 60, 150), 1),
    'of the largest floats': lambda aim: (_upright(-3e38, -3e38, 3.4e38, 3.4e38), 1),
    'negative': lambda aim: (_upright(-500, -900, 60, 150), 1),
    'turned inside out': lambda aim: (_upright(180, 190, -60, -150), 1),
    'without area': lambda aim: ([(5.0, 5.0)] * 4, 1),
    'a line': lambda aim: (_upright(10, 10, 0, 90), 1),
    'of 10^-30 px': lambda aim: (_upright(10, 10, 1e-30, 1e-30), 1),
    'crossed': lambda aim: ([_FINE[0], _FINE[2], _FINE[1], _FINE[3]], 1),
    'of noise': lambda aim: ([tuple(p) for p in aim.rng.normal(100, 200, (4, 2))], 1),
    'of wrong number of points': lambda aim: (_FINE[:1] * aim.one_of((1, 2, 3, 5, 2000)), 1),
    'with an odd id': lambda aim: (_FINE, aim.one_of((0, -1, 2**63 - 1, -(2**63), 2**31))),
    'without points, with an id': lambda aim: ([], aim.one_of((1, -7, 2**63 - 1))),
}
"""Points and track id of a box, by what is wrong with it."""

GAITS: dict[str, Callable[[Aim], dict[str, Any]]] = {
    'of other joints': lambda aim: {'name': ['knee', 'gait'], 'position': [0.0, 1.0]},
    'of one joint': lambda aim: {'name': list(GAIT_NAMES[:1]), 'position': [1.0]},
    'without positions': lambda aim: {'name': list(GAIT_NAMES)},
    'of NaN': lambda aim: {'position': [math.nan] * 2, 'velocity': [math.nan] * 2},
    'infinite': lambda aim: {'position': [math.inf, -math.inf], 'velocity': [math.inf, 0.0]},
    'of 10^300': lambda aim: {'position': [1e300, -1e300], 'velocity': [1e300, 1e300]},
    'of twenty thousand joints': lambda aim: {'name': ['x'] * 20_000, 'position': [1.0] * 20_000},
    'of the same joint twice': lambda aim: {'name': [GAIT_NAMES[0]] * 2},
}
"""Fields of a gait message, by what is wrong with it."""


def _grey(aim: Aim, about: Header, shape: tuple[int, int] | None = None) -> Any:
    """Return a likelihood, mask or prior of somebody in the middle."""
    rows, columns = shape or aim.image.shape[:2]
    image = np.full((rows, columns), 10, np.uint8)
    image[rows // 5 : -rows // 5 or None, columns // 3 : -columns // 3 or None] = 250
    return image_message(image, about)


def _gait(about: Header, **fields: Any) -> JointState:
    fine = {'name': list(GAIT_NAMES), 'position': [1.0, 0.0], 'velocity': [6.0, 0.0]}
    return JointState(header=about, **(fine | fields))


def _for_matcher(aim: Aim, **given: Any) -> Iterator[Shot]:
    about = aim.fresh()
    parts = {'box': box(about, _FINE), 'likelihood': _grey(aim, about)} | _headed(given, about)
    yield from (Shot(f'person_0/{name}', part) for name, part in parts.items())


def _for_segmenter(aim: Aim, **given: Any) -> Iterator[Shot]:
    image = aim.picture()
    about = image.header
    parts = {
        'likelihood': _grey(aim, about),
        'matched_box': box(about, _FINE),
        'shape_prior': _grey(aim, about),
        'gait': _gait(about),
    } | _headed(given, about)
    yield from (Shot(f'person_0/{name}', part) for name, part in parts.items())
    # Last, so that nothing of this frame comes from the other nodes before.
    yield Shot('image', image)


def _for_tracker(aim: Aim, **given: Any) -> Iterator[Shot]:
    # Only of a frame that it has seen does it learn.
    about = header(aim.stamp_ns)
    parts = {
        'mask': _grey(aim, about),
        'shape_prior': _grey(aim, about),
        'matched_box': box(about, _FINE),
    } | _headed(given, about)
    yield from (Shot(f'person_0/{name}', part) for name, part in parts.items())


def _headed(parts: dict[str, Any], about: Header) -> dict[str, Any]:
    for part in parts.values():
        part.header = about
    return parts


_SETS: dict[str, tuple[Callable[..., Iterator[Shot]], str, tuple[str, ...]]] = {
    'matcher': (_for_matcher, 'box', ('likelihood',)),
    'segmenter': (_for_segmenter, 'matched_box', ('likelihood', 'shape_prior')),
    'feedback': (_for_tracker, 'matched_box', ('mask', 'shape_prior')),
}
"""What makes a whole set of messages, its box and its images."""


def _boxes(target: str, how: str) -> None:
    make, name, _ = _SETS[target]

    @kind(f'{target}: box {how}', 0.6)
    def _box(aim: Aim) -> Iterator[Shot]:
        points, number = BOXES[how](aim)
        yield from make(aim, **{name: box(aim.fresh(), points, number)})


def _wrong_images(target: str) -> None:
    make, _, names = _SETS[target]

    def one(aim: Aim, image: Any) -> Iterator[Shot]:
        yield from make(aim, **{aim.one_of(names): image})

    @kind(f'{target}: image that says what is not so', 2.0)
    def _lie(aim: Aim) -> Iterator[Shot]:
        yield from one(aim, LIARS[aim.one_of(LIARS)](_grey(aim, aim.fresh())))

    @kind(f'{target}: image in colour or of another encoding')
    def _encoding(aim: Aim) -> Iterator[Shot]:
        image = image_message(aim.image, aim.fresh())
        image.encoding = aim.one_of(('bgr8', 'mono16', '32FC1', '', 'mono8'))
        yield from one(aim, image)

    @kind(f'{target}: image of another size', 2.0)
    def _size(aim: Aim) -> Iterator[Shot]:
        shape = aim.one_of(((1, 1), (1, 700), (700, 1), aim.size(), (480, 640)))
        yield from one(aim, _grey(aim, aim.fresh(), shape))

    @kind(f'{target}: image of noise, black or white')
    def _noise(aim: Aim) -> Iterator[Shot]:
        shape = aim.image.shape[:2]
        pixels = aim.one_of((aim.noise(*shape), np.zeros(shape, np.uint8)))
        yield from one(aim, image_message(aim.one_of((pixels, ~pixels)), aim.fresh()))

    @kind(f'{target}: parts of a set alone')
    def _alone(aim: Aim) -> Iterator[Shot]:
        whole = list(make(aim))
        yield whole[aim.rng.integers(len(whole))]

    @kind(f'{target}: set with an odd stamp')
    def _stamp(aim: Aim) -> Iterator[Shot]:
        seconds = aim.one_of((0, -1, -(2**31), 2**31 - 1, 3))
        for shot in make(aim):
            if shot.topic != 'image':
                shot.message.header = header(seconds * 10**9 + 5)
            yield shot


for _target in _SETS:
    for _how in BOXES:
        _boxes(_target, _how)
    _wrong_images(_target)


def _gaits(how: str) -> None:
    @kind(f'segmenter: gait {how}', 0.6)
    def _wrong_gait(aim: Aim) -> Iterator[Shot]:
        yield from _for_segmenter(aim, gait=_gait(aim.fresh(), **GAITS[how](aim)))


for _how in GAITS:
    _gaits(_how)


@kind('matcher: image_size', 0.5)
def _image_size(aim: Aim) -> Iterator[Shot]:
    sides = (0, 1, 7, 320, 65_536, 2**32 - 1)
    size = RegionOfInterest(width=aim.one_of(sides), height=aim.one_of(sides))
    yield Shot('image_size', size)
    yield from _for_matcher(aim)
    # The tracker says it again only when it changes.
    height, width = aim.image.shape[:2]
    yield Shot('image_size', RegionOfInterest(width=width, height=height))


def _region(aim: Aim) -> RegionOfInterest:
    sides = (0, 1, 3, 50, 150, 4000, 2**31, 2**32 - 1)
    x, y, width, height = (aim.one_of(sides) for _ in range(4))
    return RegionOfInterest(
        x_offset=x, y_offset=y, width=width, height=height, do_rectify=bool(x % 2)
    )


@kind('init_roi: nonsense')
def _roi(aim: Aim) -> Iterator[Shot]:
    yield Shot('init_roi', _region(aim))


@kind('init_roi: flood', 0.1)
def _roi_flood(aim: Aim) -> Iterator[Shot]:
    for _ in range(100):
        left, top = (int(value) for value in aim.rng.integers(0, 60, 2))
        region = RegionOfInterest(x_offset=60 + left, y_offset=top, width=45, height=110)
        yield Shot('init_roi', region)


def _detections(types: Any) -> None:
    """Enter what is only there with vision_msgs."""

    @kind('detections: nonsense')
    def _detect(aim: Aim) -> Iterator[Shot]:
        numbers = (math.nan, math.inf, -1.0, 0.0, 0.7, 60.0, 1e7, 1e300)
        message = types.Detection2DArray(header=aim.fresh())
        for _ in range(aim.one_of((0, 1, 5, 500))):
            result = types.ObjectHypothesisWithPose(
                hypothesis=types.ObjectHypothesis(class_id='person', score=aim.one_of(numbers))
            )
            found = types.Detection2D(results=[result] * aim.one_of((0, 1, 3)))
            found.bbox.size_x, found.bbox.size_y = aim.one_of(numbers), aim.one_of(numbers)
            found.bbox.center.position.x = aim.one_of(numbers)
            message.detections.append(found)
        yield Shot('detections', message)


_types = detection_types()
if _types is not None:
    _detections(_types)
