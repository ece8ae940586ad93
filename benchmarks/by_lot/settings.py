# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Configurations and banks by lot."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from typing import Any, TypeVar

from by_lot.pictures import Rng, walkers

from gait_segmentation.config import Parameter, StageConfig, parameters_of
from gait_segmentation.errors import ConfigError
from gait_segmentation.gait_model import BankSpec, TemplateBank, build_bank, default_bank
from gait_segmentation.matching import MatchingConfig
from gait_segmentation.people import PeopleConfig
from gait_segmentation.pipeline import PipelineConfig
from gait_segmentation.segmentation import SegmentationConfig
from gait_segmentation.starting import StartingConfig
from gait_segmentation.tracking import TrackingConfig

__all__ = ['bank_by_lot', 'changed_by_lot', 'config_by_lot']

Stage = TypeVar('Stage', bound=StageConfig)

MOST_PEOPLE, MOST_LAG = 4, 8
DEAR = {'working_height': 200, 'start_height': 120, 'shifts_x': 8, 'shifts_y': 8, 'scales': 3}
"""Largest values of what costs much time and leads nowhere else."""


def value_by_lot(rng: Rng, about: Parameter) -> Any:
    if about.choices is not None:
        return str(rng.choice(about.choices))
    if about.type is bool:
        return bool(rng.integers(2))
    if about.type is str or about.minimum is None or about.maximum is None:
        return about.default
    most = min(about.maximum, DEAR.get(about.name, math.inf))
    end = rng.random()
    value = about.minimum if end < 0.2 else most if end < 0.4 else rng.uniform(about.minimum, most)
    return round(value) if about.type is int else float(value)


def stage_by_lot(rng: Rng, stage: type[Stage], share: float, **fixed: Any) -> Stage:
    """Return a configuration of which a share is by lot; some contradict themselves."""
    while True:
        some = {
            about.name: value_by_lot(rng, about)
            for about in parameters_of(stage)
            if rng.random() < share
        }
        try:
            return stage(**(some | fixed))
        except ConfigError:
            continue


def changed_by_lot(rng: Rng, config: Stage) -> Stage:
    """Return a configuration of which some of what may change while a node runs is by lot."""
    while True:
        some = {
            about.name: value_by_lot(rng, about)
            for about in parameters_of(config)
            if not about.read_only and rng.random() < 0.2
        }
        try:
            return replace(config, **some)
        except ConfigError:
            continue


def config_by_lot(rng: Rng) -> PipelineConfig:
    share = float(rng.choice([0.0, 0.1, 0.5], p=[0.4, 0.4, 0.2]))
    lag = int(rng.integers(1, MOST_LAG)) if rng.random() < 0.2 else 0
    people = PeopleConfig(int(rng.integers(1, MOST_PEOPLE + 1)), int(rng.integers(1, 3)))
    return PipelineConfig(
        stage_by_lot(rng, TrackingConfig, share),
        stage_by_lot(rng, MatchingConfig, share, lag=lag),
        stage_by_lot(rng, SegmentationConfig, share),
        people,
        stage_by_lot(rng, StartingConfig, share),
    )


def bank_by_lot(rng: Rng) -> TemplateBank:
    return _bank(int(rng.choice(3, p=[0.7, 0.2, 0.1])))


@cache
def _bank(kind: int) -> TemplateBank:
    if kind == 0:
        return walkers()
    small = BankSpec(azimuths=2, phases=4, height=32, width=24)
    return build_bank(small) if kind == 1 else default_bank()
