# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is worn over the body: skirts, dresses and coats, and rucksacks."""

from __future__ import annotations

import itertools

import numpy as np

from gait_segmentation.gait_model.build import Build
from gait_segmentation.gait_model.skeleton import SHANK, SIDES, THIGH, Frame, Points, Skeleton
from gait_segmentation.gait_model.solid import BodyMaker, upright

__all__ = ['add_rucksack', 'add_skirt']

# Rucksack: height over the hip joint and share of the full depth.
_RUCKSACK = ((0.085, 1.0), (0.195, 1.0), (0.255, 0.6))
# Radius of the leg that carries the hem, by the distance below the hip joint.
_LEG_AT, _LEG_RADIUS = (0.0, 0.245, 0.49), (0.055, 0.042, 0.034)


def _on_leg(pose: Skeleton, side: str, below: float) -> tuple[Points, Frame]:
    """Return the point ``below`` statures down the leg from the hip, and the frame there."""
    joints = pose.joints
    if below <= THIGH:
        share, ends, name = below / THIGH, ('hip', 'knee'), 'thigh'
    else:
        share, ends, name = (below - THIGH) / SHANK, ('knee', 'ankle'), 'shank'
    start, end = (joints[f'{side}_{end}'] for end in ends)
    return start + share * (end - start), pose.frames[f'{side}_{name}']


def add_skirt(maker: BodyMaker, pose: Skeleton, build: Build, trunk: list[int]) -> None:
    """Add a skirt, dress or coat: cloth spanned between the trunk and both legs."""
    rings = [list(trunk[:2])]
    for below in (0.5 * build.hem, build.hem):
        out = build.flare * below / build.hem
        ring = []
        for side in SIDES:
            center, frame = _on_leg(pose, side, below)
            width = build.girth * np.interp(below, _LEG_AT, _LEG_RADIUS)
            ring.append(maker.ellipsoid(center, upright(frame), width + out, width + out))
        rings.append(ring)
    for upper, lower in itertools.pairwise(rings):
        maker.hull('skirt', *upper, *lower)


def add_rucksack(maker: BodyMaker, pose: Skeleton, build: Build) -> None:
    """Add a rucksack on the back."""
    frame = pose.thorax_frame
    depth = build.rucksack / 2
    members = []
    for height, share in _RUCKSACK:
        back = build.girth * 0.055 + build.trunk_cloth + share * depth - 0.01
        center = pose.pelvis + height * frame.along - back * frame.front
        members.append(maker.ellipsoid(center, frame, 0.075, share * depth + 0.01, 0.035))
    maker.chain('rucksack', members)
