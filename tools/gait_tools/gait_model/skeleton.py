# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
A walking skeleton: joint angles over the stride, and where the joints are then.

All numbers, and where they come from, stand in ``walker.json``.  Axes of the body: x forward, y to
the walker's left, z up, origin on the ground below the pelvis; the unit is the stature.  Flexion,
dorsiflexion and forward tilt are positive.  The ground is under the lowest point of both feet at
every phase, so the rise and fall of the pelvis follows from the leg angles.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

WALKER: dict[str, Any] = json.loads(
    Path(__file__).with_name('walker.json').read_text(encoding='utf-8')
)
SEGMENTS: dict[str, float] = WALKER['segments']
_ADJUST: dict[str, float] = WALKER['adjustments']

SIDES = ('right', 'left')

Points = NDArray[np.float64]


def speed_law(joint: str, speed: float) -> tuple[float, float]:
    """Return gain about the mean curve and shift (radians) of a joint at a speed, -2 to 2."""
    about = WALKER['joints'][joint]
    if 'gain' not in about:
        return 1.0, 0.0
    gain = float(np.interp(speed, WALKER['speeds'], about['gain']))
    return gain, float(np.deg2rad(np.interp(speed, WALKER['speeds'], about['shift'])))


def joint_angle(
    joint: str, phase: ArrayLike, speed: float = 0.0, amplitude: float = 1.0
) -> NDArray[np.float64]:
    """Return the angle of a joint in radians; phase 0 is the heel contact of its limb."""
    about = WALKER['joints'][joint]
    turn = 2 * np.pi * np.asarray(phase, dtype=np.float64)
    swing = np.zeros_like(turn)
    for order, (cosine, sine) in enumerate(about['harmonics'], start=1):
        swing += cosine * np.cos(order * turn) + sine * np.sin(order * turn)
    gain, shift = speed_law(joint, speed)
    return np.deg2rad(about['mean']) + shift + np.deg2rad(amplitude * gain * swing)


@dataclass(frozen=True)
class Frame:
    """A direction along a bone or block and the two across it, each (P, 3) unit vectors."""

    along: Points
    front: Points
    left: Points

    @classmethod
    def of(cls, along: Points, left: Points) -> Frame:
        """Complete a direction and a rough left to a right-handed frame."""
        along = _unit(along)
        front = _unit(np.cross(left, along))
        return cls(along, front, np.cross(along, front))


@dataclass(frozen=True)
class Skeleton:
    """
    Joints and orientations at P phases; every point is (P, 3) in statures.

    Per side ('right', 'left'): hips, knees, ankles, heels, balls, toes, shoulders, elbows, wrists
    and the frames of thighs, shanks, feet, upper arms and forearms (``along`` points away from
    the trunk; that of a foot points to the toes).  ``trunk`` runs from the pelvis to the neck.
    """

    pelvis: Points
    neck: Points
    pelvis_frame: Frame
    thorax_frame: Frame
    joints: dict[str, Points]
    frames: dict[str, Frame]


def _vector(x: ArrayLike, y: ArrayLike, z: ArrayLike) -> Points:
    return np.stack(np.broadcast_arrays(x, y, z), axis=-1).astype(np.float64)


def _unit(vector: Points) -> Points:
    return vector / np.linalg.norm(vector, axis=-1, keepdims=True)


def _leg(phase: Points, side: str, hip: Points, speed: float, shoe: float) -> tuple[dict, dict]:
    """Joints and frames of one leg; ``phase`` is the leg's own."""
    sign, lengths = (1.0 if side == 'left' else -1.0), SEGMENTS
    thigh = joint_angle('hip', phase, speed) - joint_angle('pelvis_tilt', phase)
    shank = thigh - joint_angle('knee', phase, speed, _ADJUST['knee_range'])
    foot = shank + joint_angle('ankle', phase, speed)

    def bone(name: str, angle: Points, upper: str, lower: str) -> Points:
        """Return a bone of the leg, whose ends are nearer to each other below."""
        length, adduction = lengths[name], sign * (lengths[lower] - lengths[upper])
        return _vector(length * np.sin(angle), adduction, -length * np.cos(angle))

    knee = hip + bone('thigh', thigh, 'hip_half', 'knee_half')
    ankle = knee + bone('shank', shank, 'knee_half', 'ankle_half')
    cos, sin = np.cos(foot), np.sin(foot)
    # The toes stay near the ground while the heel rises.
    toe_angle = np.where(foot < 0, 0.3 * foot, foot)
    lateral = sign * np.sin(np.deg2rad(_ADJUST['toe_out']))

    def on_foot(forward: float) -> Points:
        """Return a point of the sole."""
        down = lengths['sole']
        return ankle + _vector(
            forward * cos + down * sin, lateral * forward, forward * sin - down * cos
        )

    ball = on_foot(shoe * lengths['ball_front'])
    length = shoe * lengths['toe']
    toe = ball + _vector(length * np.cos(toe_angle), lateral * length, length * np.sin(toe_angle))
    # Bones of limbs point down: with the rough left negated their front is the body's front.
    right = _vector(np.zeros_like(thigh), -1.0, 0.0)
    heel = on_foot(-shoe * lengths['heel_back'])
    joints = {'hip': hip, 'knee': knee, 'ankle': ankle, 'heel': heel, 'ball': ball, 'toe': toe}
    outward = _vector(np.full_like(thigh, -lateral), 1.0, 0.0)
    frames = {
        'thigh': Frame.of(knee - hip, right),
        'shank': Frame.of(ankle - knee, right),
        'foot': Frame.of(_vector(cos, lateral, sin), outward),
    }
    return joints, frames


def _arm(phase: Points, side: str, shoulder: Points, swing: float) -> tuple[dict, dict]:
    """Joints and frames of one arm; ``phase`` is that of the leg on the same side."""
    sign = 1.0 if side == 'left' else -1.0
    adjust = {name: np.deg2rad(degrees) for name, degrees in _ADJUST.items()}
    upper = joint_angle('shoulder', phase, amplitude=swing) + adjust['shoulder']
    lower = upper + (joint_angle('elbow', phase, amplitude=swing) - adjust['elbow'])

    def direction(angle: Points, out: float) -> Points:
        cos_out = np.cos(out)
        return _vector(cos_out * np.sin(angle), sign * np.sin(out), -cos_out * np.cos(angle))

    upper_way = direction(upper, adjust['arm_out'])
    lower_way = direction(lower, adjust['forearm_out'])
    elbow = shoulder + SEGMENTS['upper_arm'] * upper_way
    wrist = elbow + SEGMENTS['forearm'] * lower_way
    right = _vector(np.zeros_like(upper), -1.0, 0.0)
    joints = {'shoulder': shoulder, 'elbow': elbow, 'wrist': wrist}
    return joints, {'upper_arm': Frame.of(upper_way, right), 'forearm': Frame.of(lower_way, right)}


def walk(
    phase: ArrayLike,
    *,
    speed: float = 0.0,
    arm_swing: float = 1.0,
    arm_balance: float = 0.0,
    lean: float = 0.0,
    shoe: float = 1.0,
) -> Skeleton:
    """Pose the skeleton at (P,) phases in cycles, 0 = heel contact of the right leg."""
    right = np.atleast_1d(np.asarray(phase, dtype=np.float64))
    phases = {'right': right, 'left': right + 0.5}
    # Right hip forward is a turn to the left, and obliquity is right hip up.
    rotation = joint_angle('pelvis_rotation', right)
    obliquity = joint_angle('pelvis_obliquity', right)
    left = _vector(-np.sin(rotation), np.cos(rotation), -np.sin(obliquity))
    tilt = joint_angle('thorax_tilt', right) + lean
    trunk = _vector(np.sin(tilt), 0.0, np.cos(tilt))
    turned = _ADJUST['thorax_rotation'] * rotation
    thorax_left = _vector(-np.sin(turned), np.cos(turned), 0.0)
    pelvis = np.zeros((len(right), 3))
    neck = SEGMENTS['trunk'] * trunk
    joints: dict[str, Points] = {}
    frames: dict[str, Frame] = {}
    for side in SIDES:
        sign = 1.0 if side == 'left' else -1.0
        swing = arm_swing * (1 + sign * arm_balance)
        hip = sign * SEGMENTS['hip_half'] * left
        across = sign * SEGMENTS['shoulder_half'] * thorax_left
        shoulder = neck + across - SEGMENTS['shoulder_down'] * trunk
        for found, posed in (
            _leg(phases[side], side, hip, speed, shoe),
            _arm(phases[side], side, shoulder, swing),
        ):
            joints.update({f'{side}_{name}': value for name, value in found.items()})
            frames.update({f'{side}_{name}': value for name, value in posed.items()})
    ends = [f'{side}_{end}' for side in SIDES for end in ('heel', 'ball', 'toe')]
    ground = np.min([joints[name][:, 2] for name in ends], axis=0)
    raise_by = _vector(0.0 * ground, 0.0, -ground)
    return Skeleton(
        pelvis + raise_by,
        neck + raise_by,
        Frame.of(trunk, left),
        Frame.of(trunk, thorax_left),
        {name: value + raise_by for name, value in joints.items()},
        frames,
    )
