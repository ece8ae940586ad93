# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
A body with thickness: convex pieces spanned by ellipsoids on the bones of the skeleton.

A *station* is a flat or rounded ellipsoid across a bone; a piece is the convex hull of two or
more of them.  The trunk is a stack of such pieces, each limb a chain.  Heights and lengths are
those of Drillis and Contini; the girths were chosen by the looks of real silhouettes.
"""

from __future__ import annotations

import numpy as np

from gait_segmentation.gait_model.build import Build
from gait_segmentation.gait_model.clothing import add_rucksack, add_skirt
from gait_segmentation.gait_model.skeleton import SIDES, Frame, Points, Skeleton
from gait_segmentation.gait_model.solid import Body, BodyMaker, upright

__all__ = ['make_body']

# Trunk: height over the hip joint, half breadth, half depth, shift to the front.
_TRUNK = (
    (-0.050, 0.078, 0.072, -0.009),
    (-0.005, 0.101, 0.082, -0.001),
    (0.045, 0.100, 0.079, -0.002),
    (0.100, 0.088, 0.070, -0.006),
    (0.165, 0.093, 0.069, -0.011),
    (0.225, 0.088, 0.066, -0.016),
    (0.270, 0.078, 0.051, -0.024),
)
_NECK = ((0.305, 0.046, 0.047, -0.012), (0.350, 0.033, 0.048, 0.013))
# Parts of the head: up and to the front from the top of the neck, half breadth, depth and length.
_SKULL = (0.063, 0.011, 0.045, 0.058, 0.056)
_JAW = (0.014, 0.055, 0.026, 0.022, 0.024)
_FACE = (0.055, 0.040, 0.036, 0.032, 0.040)
# Limbs: part of the bone's length, half breadth, half depth, shift to the front.
_THIGH = ((0.020, 0.053, 0.069, 0.003), (0.350, 0.051, 0.063, 0.001), (0.700, 0.043, 0.050, 0.006))
_KNEE = (0.037, 0.044, -0.003)
_SHANK = (
    (0.300, 0.033, 0.035, -0.007),
    (0.650, 0.027, 0.029, -0.002),
    (0.970, 0.024, 0.030, 0.009),
)
_UPPER_ARM = ((0.000, 0.028, 0.024, 0.000), (0.500, 0.026, 0.026, 0.000))
_ELBOW = (0.022, 0.023, 0.0)
_FOREARM = ((0.300, 0.020, 0.020, 0.001), (0.970, 0.013, 0.013, 0.000))
_HAND = (0.040, 0.013, 0.022, 0.034)  # distance from the wrist, half breadth, depth, length
# Parts of a shoe: up from the sole, forward, half breadth, height and length.
_HEEL = (0.021, 0.009, 0.022, 0.022, 0.017)
_INSTEP = (0.026, -0.030, 0.024, 0.029, 0.012)
_BALL = (0.018, 0.000, 0.030, 0.019, 0.016)
_TIP = (0.013, -0.005, 0.022, 0.014, 0.012)
_ANKLE = (0.021, 0.023, 0.0)
_SHOULDER_SLOPE = (0.85, 0.012, 0.022, 0.034, 0.020)  # share of the way to the arm, back, sizes


def _blend(first: Frame, second: Frame, share: float) -> Frame:
    """Return the frame between two that share the direction along."""
    left = (1 - share) * first.left + share * second.left
    left = left / np.linalg.norm(left, axis=-1, keepdims=True)
    front = np.cross(left, first.along)
    return Frame(first.along, front / np.linalg.norm(front, axis=-1, keepdims=True), left)


def _trunk(maker: BodyMaker, pose: Skeleton, build: Build) -> list[int]:
    """Add trunk, neck and head; return the stations of the trunk from below."""
    stations = []
    axis = pose.pelvis_frame.along
    for height, breadth, depth, shift in _TRUNK:
        share = min(max(height / _TRUNK[-1][0], 0.0), 1.0)
        frame = _blend(pose.pelvis_frame, pose.thorax_frame, share)
        center = pose.pelvis + height * axis + shift * frame.front
        cloth = build.trunk_cloth
        rounding = 0.02 if height in (_TRUNK[0][0], _TRUNK[-1][0]) else 0.0
        stations.append(
            maker.ellipsoid(
                center, frame, build.girth * breadth + cloth, build.girth * depth + cloth, rounding
            )
        )
    maker.chain('torso', stations)
    head = upright(pose.pelvis_frame)
    neck = [
        maker.ellipsoid(
            pose.pelvis + height * axis + (shift + forward) * head.front,
            head,
            (build.girth + 1) / 2 * breadth,
            (build.girth + 1) / 2 * depth,
        )
        for (height, breadth, depth, shift), forward in zip(_NECK, (0.0, build.head), strict=True)
    ]
    maker.hull('torso', stations[-1], neck[0])
    # The shoulders slope from the neck to the arms.
    slopes = []
    share, back, *sizes = _SHOULDER_SLOPE
    for side in SIDES:
        away = pose.joints[f'{side}_shoulder'] - pose.neck
        center = pose.neck + share * away - back * pose.thorax_frame.front
        slopes.append(maker.ellipsoid(center, pose.thorax_frame, *sizes))
    nape = maker.ellipsoid(pose.pelvis + 0.332 * axis - 0.006 * head.front, head, 0.030, 0.026)
    maker.hull('torso', neck[0], nape, stations[-2], *slopes)
    maker.chain('head', neck)
    # The head hangs on the top of the neck, upright whatever the trunk's lean.
    top = pose.pelvis + _NECK[-1][0] * axis + build.head * head.front

    def lump(size: tuple[float, ...], hair: float = 0.0) -> int:
        up, front, breadth, depth, length = size
        center = top + up * head.along + front * head.front
        return maker.ellipsoid(center, head, breadth + hair, depth + hair, length + hair)

    skull = lump(_SKULL, build.hair)
    maker.hull('head', skull)
    maker.hull('head', lump(_JAW), lump(_FACE))
    maker.hull('head', neck[-1], skull)
    if build.bun > 0:
        up, front, _, depth, _ = _SKULL
        ball = (up - 0.01, front - depth - build.hair - 0.4 * build.bun, *3 * (build.bun,))
        maker.hull('head', lump(ball))
    return stations


def _limb(
    maker: BodyMaker,
    part: str,
    start: Points,
    end: Points,
    frame: Frame,
    stations: tuple[tuple[float, float, float, float], ...],
    girth: float,
    cloth: float,
) -> list[int]:
    """Add the stations of one bone; the first is rounded."""
    found: list[int] = []
    for place, breadth, depth, shift in stations:
        center = start + place * (end - start) + shift * frame.front
        breadth, depth = girth * breadth + cloth, girth * depth + cloth
        found.append(
            maker.ellipsoid(center, frame, breadth, depth, 0.0 if found else 0.8 * breadth)
        )
    maker.chain(part, found)
    return found


def _joint(
    maker: BodyMaker, at: Points, frame: Frame, size: tuple, girth: float, cloth: float
) -> int:
    breadth, depth, shift = size
    breadth, depth = girth * breadth + cloth, girth * depth + cloth
    return maker.ellipsoid(at + shift * frame.front, frame, breadth, depth, depth)


def _foot(maker: BodyMaker, pose: Skeleton, side: str, ankle: int, factor: float) -> None:
    """Add a shoe; ``front`` of a foot's frame is the sole."""
    joints, frame = pose.joints, pose.frames[f'{side}_foot']

    def lump(name: str, size: tuple[float, ...]) -> int:
        up, forward, *sizes = (factor * value for value in size)
        center = joints[f'{side}_{name}'] - up * frame.front + forward * frame.along
        return maker.ellipsoid(center, frame, *sizes)

    heel, instep = lump('heel', _HEEL), lump('ball', _INSTEP)
    ball, toe = lump('ball', _BALL), lump('toe', _TIP)
    maker.hull('feet', ankle, heel)
    maker.hull('feet', ankle, instep)
    maker.hull('feet', heel, instep)
    maker.hull('feet', heel, ball, instep)
    maker.hull('feet', ball, toe)


def _leg(maker: BodyMaker, pose: Skeleton, side: str, build: Build) -> None:
    joints = pose.joints
    hip, knee, ankle = (joints[f'{side}_{name}'] for name in ('hip', 'knee', 'ankle'))
    thigh_frame, shank_frame = pose.frames[f'{side}_thigh'], pose.frames[f'{side}_shank']
    girth, cloth = build.girth, build.leg_cloth
    thigh = _limb(maker, 'legs', hip, knee, thigh_frame, _THIGH, girth, cloth)
    middle = _joint(maker, knee, thigh_frame, _KNEE, (girth + 1) / 2, cloth)
    maker.hull('legs', thigh[-1], middle)
    shank = _limb(maker, 'legs', knee, ankle, shank_frame, _SHANK, (girth + 1) / 2, cloth)
    maker.hull('legs', middle, shank[0])
    bone = _joint(maker, ankle, shank_frame, _ANKLE, 1.0, 0.0)
    maker.hull('feet', shank[-1], bone)
    _foot(maker, pose, side, bone, build.shoe)


def _arm(maker: BodyMaker, pose: Skeleton, side: str, build: Build) -> None:
    joints = pose.joints
    shoulder, elbow, wrist = (joints[f'{side}_{name}'] for name in ('shoulder', 'elbow', 'wrist'))
    upper_frame, lower_frame = pose.frames[f'{side}_upper_arm'], pose.frames[f'{side}_forearm']
    girth, cloth = build.girth, build.sleeve_cloth
    upper = _limb(maker, 'arms', shoulder, elbow, upper_frame, _UPPER_ARM, girth, cloth)
    middle = _joint(maker, elbow, upper_frame, _ELBOW, girth, cloth)
    lower = _limb(maker, 'arms', elbow, wrist, lower_frame, _FOREARM, girth, cloth)
    maker.hull('arms', upper[-1], middle)
    maker.hull('arms', middle, lower[0])
    bone = _joint(maker, wrist, lower_frame, (0.013, 0.017, 0.0), 1.0, 0.0)
    hand = maker.ellipsoid(wrist + _HAND[0] * lower_frame.along, lower_frame, *_HAND[1:])
    maker.hull('hands', bone, hand)


def make_body(pose: Skeleton, build: Build) -> Body:
    """
    Put a body on a skeleton.

    :param pose: the skeleton at P phases.
    :param build: figure and clothes.
    :returns: its ellipsoids and pieces at the same phases.
    """
    maker = BodyMaker()
    trunk = _trunk(maker, pose, build)
    for side in SIDES:
        _leg(maker, pose, side, build)
        _arm(maker, pose, side, build)
    if build.hem > 0:
        add_skirt(maker, pose, build, trunk)
    if build.rucksack > 0:
        add_rucksack(maker, pose, build)
    return maker.done()
