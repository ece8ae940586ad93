# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Parameters of starting without a box."""

from __future__ import annotations

from dataclasses import dataclass

from gait_segmentation.config import StageConfig, parameter


@dataclass(frozen=True)
class StartingConfig(StageConfig):
    """Parameters of the search for people who walk into free slots."""

    auto_init: str = parameter(
        'detector',
        'How people get a slot without a box: detector = a small network sees them, which is then '
        'asked whether they are still there, too; walk = moving blobs that keep having the shape '
        'of a body; none (or off) = not at all.',
        choices=('detector', 'walk', 'none'),
    )
    search_size: int = parameter(
        256,
        'Longest side of the image that is searched; larger sources are scaled down. For several '
        'people up to 0.375 of the source, at most 480, to find small ones.',
        unit='px',
        minimum=64,
        maximum=480,
        fixed=True,
    )
    least_height: float = parameter(
        20.0,
        'Least height of people who are searched for, in the searched image.',
        unit='px',
        minimum=12.0,
        maximum=400.0,
    )
    least_evidence: float = parameter(
        0.1,
        'Evidence from which a person is taken for a walker: log-odds times the time for which '
        'they are seen. Lower values start earlier, higher ones make fewer errors.',
        unit='s',
        minimum=0.025,
        maximum=100.0,
    )
