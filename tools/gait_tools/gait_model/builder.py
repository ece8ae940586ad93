# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Making banks from the gait model."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace

import numpy as np

from gait_segmentation.config import StageConfig, parameter
from gait_segmentation.gait_model.bank import LEAST_SIDE, TemplateBank, fine_grid, quantize
from gait_tools.gait_model.body import named_build
from gait_tools.gait_model.render import render_cycle

DIRECTIONS = 64  # from the front, views must lie this close for the phases to be told apart


@dataclass(frozen=True)
class BankSpec(StageConfig):
    """What a bank of the gait model holds: builds x azimuths sequences of ``phases`` templates."""

    height: int = parameter(96, 'Rows of a template.', unit='px', minimum=LEAST_SIDE, maximum=512)
    width: int = parameter(
        64, 'Columns of a template.', unit='px', minimum=LEAST_SIDE, maximum=512
    )
    azimuths: int = parameter(
        16,
        'Directions of walking, evenly round the full turn from 0; 2 = both side views.',
        minimum=1,
        maximum=72,
    )
    phases: int = parameter(30, 'Templates a stride.', minimum=4, maximum=240)
    builds: str = parameter('average', 'Names of builds, separated by commas.')
    elevation: float = parameter(
        0.0, 'How far the camera looks down.', unit='rad', minimum=-1.0, maximum=1.0
    )
    levels: int = parameter(
        8, 'Grey levels of a template; fewer make the matching cheaper.', minimum=2, maximum=256
    )
    fill: float = parameter(0.9, 'Share of the rows the body takes.', minimum=0.5, maximum=1.0)

    @property
    def build_names(self) -> tuple[str, ...]:
        """Return the names of the builds."""
        return tuple(name.strip() for name in self.builds.split(','))

    @property
    def azimuth_values(self) -> tuple[float, ...]:
        """Return the azimuths in (-pi, pi], starting at 0 and turning to the left."""
        turns = (k / self.azimuths for k in range(self.azimuths))
        return tuple(2 * math.pi * (t if t <= 0.5 else t - 1) for t in turns)


def build_bank(
    spec: BankSpec | None = None, progress: Callable[[], None] | None = None
) -> TemplateBank:
    """Draw a bank, by build, then azimuth, with finer views of its walkers in 64 directions."""
    spec = BankSpec() if spec is None else spec
    bank = draw_views(spec, progress)
    height, width = fine_grid(bank.grid)
    fine = replace(spec, height=height, width=width, azimuths=DIRECTIONS, levels=256)
    return replace(bank, finer=draw_views(fine, progress))


def draw_views(spec: BankSpec, progress: Callable[[], None] | None = None) -> TemplateBank:
    """Draw a bank without finer views; see :func:`build_bank`."""
    names, azimuths = spec.build_names, spec.azimuth_values
    for name in names:
        named_build(name)
    phases = np.arange(spec.phases) / spec.phases
    templates = np.empty(
        (len(names) * len(azimuths), spec.phases, spec.height, spec.width), dtype=np.uint8
    )
    for index in range(len(templates)):
        cycle = render_cycle(
            phases,
            azimuths[index % len(azimuths)],
            build=names[index // len(azimuths)],
            elevation=spec.elevation,
            grid=(spec.height, spec.width),
            fill=spec.fill,
        )
        templates[index] = quantize(cycle, spec.levels)
        if progress is not None:
            progress()
    return TemplateBank(
        templates,
        np.array(azimuths * len(names), dtype=np.float32),
        tuple(name for name in names for _ in azimuths),
        spec.fill,
        {'source': 'gait model', 'spec': json.dumps(asdict(spec), sort_keys=True)},
    )
