# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
A dressed body with thickness: convex pieces spanned by ellipsoids on the bones of the skeleton.

A *station* is a flat or rounded ellipsoid across a bone; a *piece* is the convex hull of one or
more of them and belongs to a named part.  The trunk is a stack of pieces, each limb a chain.  The
sizes stand in ``walker.json``.
"""

from __future__ import annotations

import functools
import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gait_segmentation.errors import BankError
from gait_tools.gait_model.skeleton import SEGMENTS, SIDES, WALKER, Frame, Points, Skeleton, walk

PARTS = ('head', 'torso', 'skirt', 'rucksack', 'arms', 'hands', 'legs', 'feet')

_SHAPE = WALKER['shape']


@dataclass(frozen=True)
class Build:
    """
    Body, clothes and way of walking of one person; lengths are in statures.

    :param girth: factor on the thickness of trunk and limbs.
    :param trunk_cloth: thickness of the clothes on the trunk.
    :param sleeve_cloth: thickness of the sleeves.
    :param leg_cloth: thickness of the trousers; large values hang loose below the knee.
    :param hem: length of a skirt, dress or coat below the hip joint; 0 = none, 0.25 = to the knee.
    :param flare: how far the hem stands off the leg.
    :param rucksack: depth of a rucksack; 0 = none.
    :param hair: thickness of the hair.
    :param bun: radius of hair tied at the back of the head; 0 = none.
    :param arm_swing: factor on the arms' swing about their mean.
    :param arm_balance: share of the swing that goes from the right arm to the left one: 0 both
        alike, 1 the right arm is held still, as when it carries something, -1 the left one.
    :param speed: walking speed on the scale of the norm data: -2 very slow, 0 free, 2 very fast.
    :param lean: lean of the trunk beyond the usual, radians, positive forward.
    :param shoe: factor on the size of the feet and shoes.
    """

    girth: float = 1.0
    trunk_cloth: float = 0.012
    sleeve_cloth: float = 0.010
    leg_cloth: float = 0.012
    hem: float = 0.0
    flare: float = 0.015
    rucksack: float = 0.0
    hair: float = 0.009
    bun: float = 0.0
    arm_swing: float = 1.1
    arm_balance: float = 0.0
    speed: float = -0.3
    lean: float = 0.0
    shoe: float = 1.0


BUILDS = {name: Build(**changes) for name, changes in WALKER['builds'].items()}

FIGURES = ('average', 'rucksack', 'dress', 'coat', 'stout', 'slim')
"""Builds that made-up walkers have; another one here would change every clip drawn so far."""


def named_build(build: str | Build) -> Build:
    """Return a build by name; a build is passed through."""
    if isinstance(build, Build):
        return build
    if build not in BUILDS:
        raise BankError(f'build must be one of {", ".join(BUILDS)}, got {build!r}')
    return BUILDS[build]


class Body:
    """
    Ellipsoids and the pieces they span.

    ``centers`` are (P, E, 3) in statures, axes of the body as in the skeleton, and ``axes``
    (P, E, 3, 3) the semi-axes as columns; ``pieces`` are the ellipsoids of every piece and
    ``parts`` the part of each, an index into :data:`PARTS`.
    """

    def __init__(self) -> None:
        self._centers: list[Points] = []
        self._axes: list[Points] = []
        self.pieces: list[tuple[int, ...]] = []
        self.parts: list[int] = []

    @property
    def centers(self) -> Points:
        """Return the centres of all ellipsoids."""
        return np.stack(self._centers, axis=1)

    @property
    def axes(self) -> Points:
        """Return the semi-axes of all ellipsoids."""
        return np.stack(self._axes, axis=1)

    def ellipsoid(
        self, center: Points, frame: Frame, breadth: float, depth: float, length: float = 0.0
    ) -> int:
        """Add an ellipsoid with half sizes along ``left``, ``front`` and ``along``."""
        self._centers.append(center)
        self._axes.append(
            np.stack([breadth * frame.left, depth * frame.front, length * frame.along], axis=-1)
        )
        return len(self._centers) - 1

    def hull(self, part: str, *members: int) -> None:
        """Add the convex hull of some ellipsoids."""
        self.pieces.append(members)
        self.parts.append(PARTS.index(part))

    def chain(self, part: str, members: list[int]) -> None:
        """Add the hulls of neighbours."""
        for first, second in itertools.pairwise(members):
            self.hull(part, first, second)


def _upright(frame: Frame) -> Frame:
    """Return the frame with the same phases that is upright and looks ahead."""
    one = np.broadcast_to(np.eye(3), (len(frame.along), 3, 3))
    return Frame(one[:, 2], one[:, 0], one[:, 1])


def _blend(first: Frame, second: Frame, share: float) -> Frame:
    """Return the frame between two that share the direction along."""
    left = (1 - share) * first.left + share * second.left
    left = left / np.linalg.norm(left, axis=-1, keepdims=True)
    front = np.cross(left, first.along)
    return Frame(first.along, front / np.linalg.norm(front, axis=-1, keepdims=True), left)


def _trunk(body: Body, pose: Skeleton, build: Build) -> list[int]:
    """Add the trunk; return its stations from below."""
    rows, cloth, stations = _SHAPE['trunk'], build.trunk_cloth, []
    for height, breadth, depth, shift in rows:
        share = min(max(height / rows[-1][0], 0.0), 1.0)
        frame = _blend(pose.pelvis_frame, pose.thorax_frame, share)
        center = pose.pelvis + height * frame.along + shift * frame.front
        rounding = 0.02 if height in (rows[0][0], rows[-1][0]) else 0.0
        breadth, depth = build.girth * breadth + cloth, build.girth * depth + cloth
        stations.append(body.ellipsoid(center, frame, breadth, depth, rounding))
    body.chain('torso', stations)
    return stations


def _neck(body: Body, pose: Skeleton, build: Build, trunk: list[int]) -> int:
    """Add the neck, and shoulders that slope from it to the arms; return the neck's top."""
    axis, head = pose.pelvis_frame.along, _upright(pose.pelvis_frame)
    neck = []
    for height, *sizes, shift in _SHAPE['neck']:
        breadth, depth = ((build.girth + 1) / 2 * size for size in sizes)
        center = pose.pelvis + height * axis + shift * head.front
        neck.append(body.ellipsoid(center, head, breadth, depth))
    body.hull('torso', trunk[-1], neck[0])
    slopes = []
    share, back, *sizes = _SHAPE['shoulder_slope']
    for side in SIDES:
        away = pose.joints[f'{side}_shoulder'] - pose.neck
        center = pose.neck + share * away - back * pose.thorax_frame.front
        slopes.append(body.ellipsoid(center, pose.thorax_frame, *sizes))
    height, breadth, depth, shift = _SHAPE['nape']
    nape = body.ellipsoid(pose.pelvis + height * axis + shift * head.front, head, breadth, depth)
    body.hull('torso', neck[0], nape, trunk[-2], *slopes)
    body.chain('head', neck)
    return neck[-1]


def _head(body: Body, pose: Skeleton, build: Build, neck: int) -> None:
    """Add a head, which hangs on the top of the neck, upright whatever the trunk's lean."""
    head = _upright(pose.pelvis_frame)
    top = pose.pelvis + _SHAPE['neck'][-1][0] * pose.pelvis_frame.along

    def lump(size: list[float], hair: float = 0.0) -> int:
        up, front, breadth, depth, length = size
        center = top + up * head.along + front * head.front
        return body.ellipsoid(center, head, breadth + hair, depth + hair, length + hair)

    skull = lump(_SHAPE['skull'], build.hair)
    body.hull('head', skull)
    body.hull('head', lump(_SHAPE['jaw']), lump(_SHAPE['face']))
    body.hull('head', neck, skull)
    if build.bun > 0:
        up, front, _, depth, _ = _SHAPE['skull']
        place = [up - 0.01, front - depth - build.hair - 0.4 * build.bun]
        body.hull('head', lump([*place, *3 * [build.bun]]))


def _limb(
    body: Body, part: str, ends: list[Points], frame: Frame, bone: str, girth: float, cloth: float
) -> list[int]:
    """Add the stations of one bone; the first is rounded."""
    start, end = ends
    found: list[int] = []
    for place, breadth, depth, shift in _SHAPE[bone]:
        center = start + place * (end - start) + shift * frame.front
        breadth, depth = girth * breadth + cloth, girth * depth + cloth
        length = 0.0 if found else 0.8 * breadth
        found.append(body.ellipsoid(center, frame, breadth, depth, length))
    body.chain(part, found)
    return found


def _joint(
    body: Body, at: Points, frame: Frame, name: str, girth: float = 1.0, cloth: float = 0.0
) -> int:
    breadth, depth, shift = _SHAPE[name]
    breadth, depth = girth * breadth + cloth, girth * depth + cloth
    return body.ellipsoid(at + shift * frame.front, frame, breadth, depth, depth)


def _foot(body: Body, pose: Skeleton, side: str, ankle: int, factor: float) -> None:
    """Add a shoe; ``front`` of a foot's frame is the sole."""
    joints, frame = pose.joints, pose.frames[f'{side}_foot']

    def lump(joint: str, name: str) -> int:
        up, forward, *sizes = (factor * value for value in _SHAPE[name])
        center = joints[f'{side}_{joint}'] - up * frame.front + forward * frame.along
        return body.ellipsoid(center, frame, *sizes)

    heel, instep = lump('heel', 'heel'), lump('ball', 'instep')
    ball, toe = lump('ball', 'ball'), lump('toe', 'tip')
    body.hull('feet', ankle, heel)
    body.hull('feet', ankle, instep)
    body.hull('feet', heel, instep)
    body.hull('feet', heel, ball, instep)
    body.hull('feet', ball, toe)


def _leg(body: Body, pose: Skeleton, side: str, build: Build) -> None:
    hip, knee, ankle = (pose.joints[f'{side}_{name}'] for name in ('hip', 'knee', 'ankle'))
    thigh_frame, shank_frame = pose.frames[f'{side}_thigh'], pose.frames[f'{side}_shank']
    girth, calf, cloth = build.girth, (build.girth + 1) / 2, build.leg_cloth
    thigh = _limb(body, 'legs', [hip, knee], thigh_frame, 'thigh', girth, cloth)
    middle = _joint(body, knee, thigh_frame, 'knee', calf, cloth)
    body.hull('legs', thigh[-1], middle)
    shank = _limb(body, 'legs', [knee, ankle], shank_frame, 'shank', calf, cloth)
    body.hull('legs', middle, shank[0])
    bone = _joint(body, ankle, shank_frame, 'ankle')
    body.hull('feet', shank[-1], bone)
    _foot(body, pose, side, bone, build.shoe)


def _arm(body: Body, pose: Skeleton, side: str, build: Build) -> None:
    joints = pose.joints
    shoulder, elbow, wrist = (joints[f'{side}_{name}'] for name in ('shoulder', 'elbow', 'wrist'))
    upper_frame, lower_frame = pose.frames[f'{side}_upper_arm'], pose.frames[f'{side}_forearm']
    girth, cloth = build.girth, build.sleeve_cloth
    upper = _limb(body, 'arms', [shoulder, elbow], upper_frame, 'upper_arm', girth, cloth)
    middle = _joint(body, elbow, upper_frame, 'elbow', girth, cloth)
    lower = _limb(body, 'arms', [elbow, wrist], lower_frame, 'forearm', girth, cloth)
    body.hull('arms', upper[-1], middle)
    body.hull('arms', middle, lower[0])
    bone = _joint(body, wrist, lower_frame, 'wrist')
    away, *sizes = _SHAPE['hand']
    hand = body.ellipsoid(wrist + away * lower_frame.along, lower_frame, *sizes)
    body.hull('hands', bone, hand)


def _on_leg(pose: Skeleton, side: str, below: float) -> tuple[Points, Frame]:
    """Return the point ``below`` statures down the leg from the hip, and the frame there."""
    bone, ends, above = 'thigh', ('hip', 'knee'), 0.0
    if below > SEGMENTS['thigh']:
        bone, ends, above = 'shank', ('knee', 'ankle'), SEGMENTS['thigh']
    start, end = (pose.joints[f'{side}_{name}'] for name in ends)
    share = (below - above) / SEGMENTS[bone]
    return start + share * (end - start), pose.frames[f'{side}_{bone}']


def _skirt(body: Body, pose: Skeleton, build: Build, trunk: list[int]) -> None:
    """Add a skirt, dress or coat: cloth spanned between the trunk and both legs."""
    at, radius = zip(*_SHAPE['hem'], strict=True)
    rings = [list(trunk[:2])]
    for below in (0.5 * build.hem, build.hem):
        width = build.girth * np.interp(below, at, radius) + build.flare * below / build.hem
        ring = []
        for side in SIDES:
            center, frame = _on_leg(pose, side, below)
            ring.append(body.ellipsoid(center, _upright(frame), width, width))
        rings.append(ring)
    for upper, lower in itertools.pairwise(rings):
        body.hull('skirt', *upper, *lower)


def _rucksack(body: Body, pose: Skeleton, build: Build) -> None:
    """Add a rucksack on the back."""
    frame = pose.thorax_frame
    depth = build.rucksack / 2
    members = []
    for height, share in _SHAPE['rucksack']:
        back = build.girth * 0.055 + build.trunk_cloth + share * depth - 0.01
        center = pose.pelvis + height * frame.along - back * frame.front
        members.append(body.ellipsoid(center, frame, 0.075, share * depth + 0.01, 0.035))
    body.chain('rucksack', members)


def body_at(phases: ArrayLike, build: Build) -> Body:
    """
    Return the body of a build, with its clothes, at (P,) phases of its walk.

    It is kept and shared, for it is seen from many sides, and not to be changed.
    """
    return _body_at(tuple(np.atleast_1d(np.asarray(phases, np.float64)).tolist()), build)


@functools.lru_cache(maxsize=16)
def _body_at(phases: tuple[float, ...], build: Build) -> Body:
    walking = ('speed', 'arm_swing', 'arm_balance', 'lean', 'shoe')
    pose = walk(phases, **{name: getattr(build, name) for name in walking})
    body = Body()
    trunk = _trunk(body, pose, build)
    _head(body, pose, build, _neck(body, pose, build, trunk))
    for side in SIDES:
        _leg(body, pose, side, build)
        _arm(body, pose, side, build)
    if build.hem > 0:
        _skirt(body, pose, build, trunk)
    if build.rucksack > 0:
        _rucksack(body, pose, build)
    return body
