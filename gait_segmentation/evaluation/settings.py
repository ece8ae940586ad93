# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Changing parameters of a nested configuration by name: ``stage.parameter=value``."""

from __future__ import annotations

import dataclasses
import difflib
from collections.abc import Iterable
from typing import Any, TypeVar

from gait_segmentation.config import Parameter, StageConfig, parameters_of
from gait_segmentation.errors import ConfigError

__all__ = ['overridden', 'parse_value', 'replaced', 'stages_of']

Config = TypeVar('Config')


def stages_of(config: Any) -> dict[str, StageConfig]:
    """Return the stages' configurations of a pipeline's by name."""
    return {field.name: getattr(config, field.name) for field in dataclasses.fields(config)}


def parse_value(about: Parameter, text: str) -> bool | int | float | str:
    """
    Turn a text into a value of a parameter's type; the range is checked elsewhere.

    :raises ConfigError: with the parameter's name, the text and what is allowed.
    """
    if about.type is bool:
        words = {'true': True, 'false': False, '1': True, '0': False, 'yes': True, 'no': False}
        if text.lower() not in words:
            raise ConfigError(f'{about.name} must be {about.allowed()}, got {text!r}')
        return words[text.lower()]
    try:
        return about.type(text)
    except ValueError:
        raise ConfigError(f'{about.name} must be {about.allowed()}, got {text!r}') from None


def replaced(config: Config, stage: str, name: str, value: Any) -> Config:
    """Return a pipeline's configuration with one parameter changed."""
    changed = dataclasses.replace(stages_of(config)[stage], **{name: value})
    return dataclasses.replace(config, **{stage: changed})  # type: ignore[type-var]


def overridden(config: Config, settings: Iterable[str]) -> Config:
    """
    Return a pipeline's configuration with settings such as ``segmentation.contrast=3`` applied.

    :raises ConfigError: if a setting is malformed, unknown or out of range; the message names
        what there is.
    """
    for setting in settings:
        path, equals, text = setting.partition('=')
        stage, dot, name = path.strip().partition('.')
        if not equals or not dot:
            raise ConfigError(f'a setting must be STAGE.PARAMETER=VALUE, got {setting!r}')
        stages = stages_of(config)
        if stage not in stages:
            raise ConfigError(f'the stage of {setting!r} must be one of {", ".join(stages)}')
        known = {about.name: about for about in parameters_of(stages[stage])}
        if name not in known:
            alike = difflib.get_close_matches(name, known, n=3) or known
            raise ConfigError(f'{stage} has no parameter {name!r}, but {", ".join(alike)}')
        config = replaced(config, stage, name, parse_value(known[name], text.strip()))
    return config
