# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Parameters of the networks that look at whole images."""

from __future__ import annotations

from dataclasses import dataclass

from gait_segmentation.config import StageConfig, parameter

BOXES, PEOPLE = 'boxes', 'people'
"""Networks that have a name."""


@dataclass(frozen=True)
class DetectorConfig(StageConfig):
    """Which network looks at whole images, and how often."""

    network: str = parameter(
        BOXES,
        'boxes = the detector of this package, where starting.auto_init asks for it; people = it '
        'and a heat map of all whom it sees, by a second network that gait_warm_up --people '
        'fetches once; FILE.onnx = a network of your own, for boxes or a heat map.',
        fixed=True,
    )
    calm_period: float = parameter(
        0.4,
        'Time between two looks for boxes while all is well.',
        unit='s',
        minimum=0.0,
        maximum=60.0,
        fixed=True,
    )
    urgent_period: float = parameter(
        0.1,
        'The same while nobody is tracked, somebody is lost or was not seen, or boxes are needed '
        'for a heat map.',
        unit='s',
        minimum=0.0,
        maximum=60.0,
        fixed=True,
    )
