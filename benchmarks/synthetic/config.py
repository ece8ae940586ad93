# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What can be chosen about a synthetic sequence."""

from __future__ import annotations

import math
from dataclasses import dataclass

from gait_segmentation.config import StageConfig, parameter
from gait_segmentation.gait_model import BUILDS

__all__ = ['SyntheticConfig']


@dataclass(frozen=True)
class SyntheticConfig(StageConfig):
    """Parameters of a synthetic sequence."""

    seed: int = parameter(0, 'Of everything drawn by lot.', minimum=0)
    width: int = parameter(320, 'Width of the images.', unit='px', minimum=32, maximum=4096)
    height: int = parameter(240, 'Height of the images.', unit='px', minimum=32, maximum=4096)
    fps: float = parameter(25.0, 'Frame rate.', unit='1/s', minimum=1.0, maximum=240.0)
    frames: int = parameter(50, 'Number of frames.', minimum=1, maximum=100000)
    person_height: float = parameter(
        120.0, 'Height of the first walker half way.', unit='px', minimum=16.0, maximum=4096.0
    )
    azimuth: float = parameter(
        0.0,
        'Walking direction of the first walker: 0 right, pi/2 away, pi left, -pi/2 closer.',
        unit='rad',
        minimum=-math.pi,
        maximum=math.pi,
    )
    stride_rate: float = parameter(
        0.9, 'Strides (two steps) per second.', unit='1/s', minimum=0.2, maximum=2.0
    )
    build: str = parameter(
        'average', 'Build and clothes of the first walker.', choices=tuple(BUILDS)
    )
    walkers: int = parameter(
        1, 'How many people walk; the first is tracked.', minimum=1, maximum=9
    )
    pan: float = parameter(
        0.0,
        'Motion of the camera to the right, seen on the first walker half way.',
        unit='px/frame',
        minimum=-100.0,
        maximum=100.0,
    )
    jitter: float = parameter(
        0.3, 'Standard deviation of the shake.', unit='px', minimum=0.0, maximum=20.0
    )
    clutter: float = parameter(
        0.5, 'Things before the wall: 0 none, 1 crowded.', minimum=0.0, maximum=3.0
    )
    occluder: bool = parameter(False, 'Put a post between the camera and the way.')
    shadow: bool = parameter(False, 'Let the walkers cast soft shadows.')
    noise: float = parameter(
        3.0, 'Standard deviation of the sensor noise.', minimum=0.0, maximum=50.0
    )
    blur: float = parameter(
        0.5, 'Standard deviation of the blur of the lens.', unit='px', minimum=0.0, maximum=10.0
    )
