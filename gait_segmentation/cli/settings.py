# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The parameters of a pipeline from ROS parameter files: presets, and a user's own."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from gait_segmentation.config import parameters_of, replaced, stages_of
from gait_segmentation.errors import ConfigError, GaitSegmentationError
from gait_segmentation.files import read_yaml
from gait_segmentation.pipeline import PipelineConfig
from gait_segmentation.streams.config import (
    OF_NODES,
    BankConfig,
    StartConfig,
    misnamed,
    qualified,
    sections_of,
    unused,
)

_SECTIONS = ('gait_tracker', 'gait_matcher', 'gait_segmenter', 'gait_pipeline', '**', '*')
_UNNAMED = 'people'
"""The stage whose parameters have no prefix in ROS, and here either way."""


@dataclass(frozen=True)
class Settings:
    """What a parameter file says that concerns a pipeline."""

    config: PipelineConfig = field(default_factory=PipelineConfig)
    start: StartConfig = field(default_factory=StartConfig)
    bank: BankConfig = field(default_factory=BankConfig)


def read_parameter_file(path: Path, settings: Settings | None = None) -> Settings:
    """
    Return what a ROS parameter file says, as the nodes read it.

    Sections of other nodes, and parameters that only nodes have, are left out.

    :param settings: what holds where the file says nothing; the defaults if None.
    :raises ConfigError: if it cannot be read, nothing in it is for a node of this package, or a
        stage has no such parameter or value.
    """
    settings = settings or Settings()
    content = read_yaml(path, ConfigError)
    if why := unused(content):
        raise ConfigError(f'{path}: {why}')
    for name, section in sections_of(content):
        if name not in _SECTIONS:
            continue
        given = _flat(section)
        for parameter, meant in misnamed(given, _names(settings.config)).items():
            hint = f': did you mean {meant}?' if meant else ', see docs/parameters.md'
            raise ConfigError(f'{path}: there is no parameter {parameter}{hint}')
        for parameter, value in given.items():
            try:
                settings = _changed(settings, parameter, value)
            except GaitSegmentationError as error:
                raise ConfigError(f'{path}: {error}') from error
    return settings


def _names(config: PipelineConfig) -> list[str]:
    """Return the names of all parameters that the nodes have."""
    groups = [(stage, type(values)) for stage, values in stages_of(config).items()]
    groups += [('', kind) for kind in (type(stages_of(config)[_UNNAMED]), *OF_NODES)]
    return [
        qualified(group, about.name) for group, kind in groups for about in parameters_of(kind)
    ]


def _flat(values: Any, prefix: str = '') -> dict[str, Any]:
    """Return nested sections as names with dots."""
    if not isinstance(values, dict):
        return {prefix.rstrip('.'): values}
    found: dict[str, Any] = {}
    for name, value in values.items():
        found |= _flat(value, f'{prefix}{name}.')
    return found


def _changed(settings: Settings, name: str, value: Any) -> Settings:
    for field_name in ('start', 'bank'):
        own = getattr(settings, field_name)
        if name in (about.name for about in parameters_of(own)):
            return replace(settings, **{field_name: replace(own, **{name: value})})
    given, _, parameter = name.rpartition('.')
    stage = given or _UNNAMED
    if stage not in stages_of(settings.config):
        return settings
    known = [about.name for about in parameters_of(stages_of(settings.config)[stage])]
    if parameter not in known:
        return settings
    return replace(settings, config=replaced(settings.config, stage, parameter, value))
