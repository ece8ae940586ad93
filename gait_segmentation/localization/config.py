# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Parameters of the localization."""

from __future__ import annotations

from dataclasses import dataclass

from gait_segmentation.config import StageConfig, parameter


@dataclass(frozen=True)
class LocalizationConfig(StageConfig):
    """Parameters of the localization."""

    camera_height: float = parameter(
        0.0,
        'Height of the camera above the ground, where there is no ground_frame. 0 = unknown: '
        'only depth images locate people.',
        unit='m',
        minimum=0.0,
        maximum=100.0,
    )
    camera_pitch: float = parameter(
        0.0,
        'How far the camera looks down, where there is no ground_frame.',
        unit='degrees',
        minimum=-89.0,
        maximum=89.0,
    )
    window: float = parameter(
        2.0,
        'Time over which places give the velocity. Raising it makes speed and heading calmer, '
        'above all without depth.',
        unit='s',
        minimum=0.1,
        maximum=10.0,
    )
    acceleration: float = parameter(
        0.3,
        'Usual acceleration of people, in turns above all. Raising it lets the heading follow '
        'turns faster, and makes it less calm.',
        unit='m/s^2',
        minimum=0.001,
        maximum=100.0,
    )
    max_distance: float = parameter(
        20.0,
        'Distance on the ground up to which people are located; depths beyond count as invalid.',
        unit='m',
        minimum=0.1,
        maximum=1000.0,
    )
    surface_depth: float = parameter(
        0.14,
        "How far a body's axis lies behind the surface that a depth camera sees (median).",
        unit='m',
        minimum=0.0,
        maximum=0.5,
    )
    depth_error: float = parameter(
        0.01,
        'Standard deviation of the distance by depth, as a share of it, for the covariance.',
        minimum=0.0,
        maximum=1.0,
    )
    feet_error: float = parameter(
        0.02,
        'Standard deviation of where the soles are in the image, in body heights, for the '
        'covariance.',
        minimum=0.001,
        maximum=1.0,
    )
    gait_error: float = parameter(
        20.0,
        'Standard deviation of the walking direction by gait. Raising it makes the heading follow '
        "the track's motion more.",
        unit='degrees',
        minimum=1.0,
        maximum=180.0,
    )
