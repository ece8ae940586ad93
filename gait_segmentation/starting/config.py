# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Parameters of how people are found without a box."""

from __future__ import annotations

from dataclasses import dataclass

from gait_segmentation.config import StageConfig, parameter


@dataclass(frozen=True)
class StartingConfig(StageConfig):
    """Parameters of how people are found without a box."""

    least_height: float = parameter(
        0.078,
        'Least height of people who are found, as a share of the longer side of the image.',
        minimum=0.0,
        maximum=1.0,
    )
