# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A short walk as the pipeline sees it, which the tests of the figures share."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from gait_segmentation.pipeline import Pipeline, PipelineConfig
from gait_tools.figures.walk import Shot, Walk, figured, open_walk, record
from test.walkers import small_bank

EXAMPLE = Path(__file__).parents[3] / 'examples/walker'


@cache
def short(frames: int = 8) -> tuple[Shot, ...]:
    """Return the first frames of the example."""
    whole = open_walk(EXAMPLE, None)
    walk = Walk(
        'short', whole.box, lambda: (each for each in whole.frames() if each.number < frames)
    )
    return tuple(record(Pipeline(figured(PipelineConfig()), small_bank()), walk))
