# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Parameters of the matching stage."""

from __future__ import annotations

from dataclasses import dataclass

from gait_segmentation.config import StageConfig, parameter
from gait_segmentation.errors import ConfigError


@dataclass(frozen=True)
class MatchingConfig(StageConfig):
    """
    Parameters of the matching stage; lengths are in body heights unless a unit is given.

    :raises ConfigError: if a value is not allowed or two contradict each other.
    """

    kernel: str = parameter(
        'events',
        'How templates are compared, to the same bits: by what changes between them, or by the '
        "paper's sorted direct access table.",
        choices=('events', 'direct_access_table'),
        fixed=True,
    )
    lag: int = parameter(
        0,
        'Frames by which results are delayed. 0 = filtering; more lets later frames correct '
        'earlier ones.',
        unit='frames',
        minimum=0,
        maximum=300,
        fixed=True,
    )
    window: float = parameter(
        1.2,
        'Length of the window in which the path is traced back, about one stride.',
        unit='s',
        minimum=0.2,
        maximum=5.0,
    )
    memory: float = parameter(
        0.8,
        'Time constant with which the evidence of past frames fades in the path score.',
        unit='s',
        minimum=0.05,
        maximum=10.0,
    )
    shifts_x: int = parameter(
        5,
        'Horizontal shifts searched to either side of the box.',
        minimum=0,
        maximum=16,
        fixed=True,
    )
    shifts_y: int = parameter(
        5,
        'Vertical shifts searched to either side of the box.',
        minimum=0,
        maximum=16,
        fixed=True,
    )
    scales: int = parameter(
        2,
        'Body heights searched above and below the height of the box.',
        minimum=0,
        maximum=5,
        fixed=True,
    )
    scale_reach: int = parameter(
        1,
        'Body heights searched above and below the one the path leads to; in its first frame '
        'all are.',
        minimum=1,
        maximum=5,
        fixed=True,
    )
    shift_reach: int = parameter(
        3,
        'Shifts searched to each side of where the path leads; in its first frame all are.',
        minimum=1,
        maximum=16,
        fixed=True,
    )
    shift_step: float = parameter(
        0.02,
        'Distance of neighbouring shifts; rounded to whole pixels of the template grid.',
        unit='body height',
        minimum=0.005,
        maximum=0.1,
        fixed=True,
    )
    scale_step: float = parameter(
        0.08,
        'Relative difference of neighbouring body heights.',
        minimum=0.01,
        maximum=0.3,
        fixed=True,
    )
    blur: int = parameter(
        3,
        'Side of the box filter on the likelihood; 1 = none.',
        unit='px',
        minimum=1,
        maximum=15,
    )
    levels: int = parameter(
        8,
        'Grey levels templates are rounded to for matching; fewer are faster.',
        minimum=2,
        maximum=256,
        fixed=True,
    )
    use_likely_box: bool = parameter(
        True,
        'The refined box is tight about the likely pixels where the template stands; if not, it '
        'is as in the paper the tracked box placed there.',
    )
    minimum_cadence: float = parameter(
        60.0, 'Slowest walk expected.', unit='steps/min', minimum=0.0, maximum=300.0
    )
    maximum_cadence: float = parameter(
        160.0, 'Fastest walk possible.', unit='steps/min', minimum=30.0, maximum=400.0
    )
    rate_cost: float = parameter(
        0.5,
        'Cost, in similarity, of a step that differs from the expected one by a whole stride.',
        minimum=0.0,
        maximum=10.0,
    )
    move_cost: float = parameter(
        0.01,
        'Cost, in similarity, of moving the placement by one step in one direction.',
        minimum=0.0,
        maximum=1.0,
    )
    scale_cost: float = parameter(
        0.2,
        'Cost, in similarity, of a body height that differs from the height of the box, times '
        'the logarithm of their ratio.',
        minimum=0.0,
        maximum=2.0,
    )
    view_cost: float = parameter(
        0.05,
        'Cost, in similarity, of turning to a neighbouring view.',
        minimum=0.0,
        maximum=1.0,
    )
    build_cost: float = parameter(
        0.1, 'Cost, in similarity, of changing the build.', minimum=0.0, maximum=1.0
    )
    switch_margin: float = parameter(
        0.5,
        'How far, in similarity summed over the memory, another path must lead before it '
        'replaces the one followed; keeps the choice between half-cycle twins stable.',
        minimum=0.0,
        maximum=5.0,
    )

    @property
    def slowest_rate(self) -> float:
        """Return the rate of the slowest walk in strides (two steps) per second."""
        return self.minimum_cadence / 120

    @property
    def fastest_rate(self) -> float:
        """Return the rate of the fastest walk in strides per second."""
        return self.maximum_cadence / 120

    @property
    def middle_rate(self) -> float:
        """Return the rate half way between the two."""
        return (self.minimum_cadence + self.maximum_cadence) / 240

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.minimum_cadence >= self.maximum_cadence:
            raise ConfigError(
                'minimum_cadence must be below maximum_cadence, got '
                f'{self.minimum_cadence:g} and {self.maximum_cadence:g}'
            )
