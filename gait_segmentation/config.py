# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The one declarative form of a parameter.

Every stage has one frozen dataclass derived from :class:`StageConfig`, whose fields are made
with :func:`parameter`.  Name, default, range, unit and description stand there and nowhere else:
ROS parameters, the YAML file, command-line flags and the tables in the docs are made from it.
Those named ``use_...`` leave a mechanism out, to see what it is worth: only presets and ``--set``
name them.
"""

from __future__ import annotations

import dataclasses
import difflib
import math
from array import array
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, TypeVar

from gait_segmentation.errors import ConfigError

Stages = TypeVar('Stages')

_KEY = 'gait_segmentation.parameter'
_NONE = ('off', 'false')
"""Other words for ``none``."""

_TRUTHS = {'true': True, 'false': False, '1': True, '0': False, 'yes': True, 'no': False}


def _is_finite(value: Any) -> bool:
    return isinstance(value, float) and math.isfinite(value)


@dataclass(frozen=True)
class Parameter:
    """What is known about one parameter besides its value."""

    name: str
    type: type
    default: Any
    description: str
    unit: str
    minimum: float | None
    maximum: float | None
    choices: tuple[str, ...] | None
    fixed: bool
    read_only: bool = False
    names: tuple[str, ...] = ()

    @property
    def is_switch(self) -> bool:
        """Return whether it only leaves a mechanism out: no parameter of nodes unless set."""
        return self.name.startswith('use_')

    def allowed(self) -> str:
        """Say in words which values are allowed."""
        if self.choices is not None:
            return 'one of ' + ', '.join(self.choices)
        if self.type is tuple:
            return f'{len(self.default)} finite numbers'
        kind = {bool: 'true or false', int: 'an integer', float: 'a number', str: 'a string'}
        words = kind[self.type]
        if self.minimum is not None and self.maximum is not None:
            words += f' from {self.minimum:g} to {self.maximum:g}'
        elif self.minimum is not None:
            words += f' of at least {self.minimum:g}'
        elif self.maximum is not None:
            words += f' of at most {self.maximum:g}'
        return words

    def meant(self, value: Any) -> Any:
        """
        Return what a value stands for, of the parameter's type where there is no doubt.

        An integer stands for a number, a list for a tuple, and ``off``, which YAML 1.1 reads as
        false, for ``none``.
        """
        if self.type is tuple and isinstance(value, list | array):
            return tuple(float(each) if type(each) is int else each for each in value)
        if self.type is float and type(value) is int:
            try:
                return float(value)
            except OverflowError:
                return math.inf
        if 'none' in (self.choices or self.names) and (value is False or value in _NONE):
            return 'none'
        return value

    def check(self, value: Any) -> None:
        """Raise ConfigError, which says what is allowed, if a value is not."""
        if self.type is float:
            right = _is_finite(value)
        elif self.type is tuple:
            right = isinstance(value, tuple) and len(value) == len(self.default)
            right = right and all(map(_is_finite, value))
        else:
            right = type(value) is self.type
        right = right and (self.choices is None or value in self.choices)
        right = right and (self.minimum is None or value >= self.minimum)
        right = right and (self.maximum is None or value <= self.maximum)
        if not right:
            shown = list(value) if isinstance(value, tuple) else value
            raise ConfigError(f'{self.name} must be {self.allowed()}, got {shown!r}')

    def parsed(self, text: str) -> bool | int | float | str:
        """
        Return the value of the parameter's type that a text gives; its range is checked elsewhere.

        :raises ConfigError: with the parameter's name, the text and what is allowed.
        """
        try:
            return _TRUTHS[text.lower()] if self.type is bool else self.type(text)
        except (KeyError, ValueError):
            raise ConfigError(f'{self.name} must be {self.allowed()}, got {text!r}') from None


def parameter(
    default: Any,
    description: str,
    *,
    unit: str = '',
    minimum: float | None = None,
    maximum: float | None = None,
    choices: tuple[str, ...] | None = None,
    fixed: bool = False,
    read_only: bool = False,
    names: tuple[str, ...] = (),
) -> Any:
    """
    Declare one parameter of a stage.

    :param default: its default; its type (bool, int, float, str, or a tuple of floats)
        is that of the parameter.
    :param description: what raising or switching it does, one or two sentences.
    :param unit: unit of the value, empty if it has none.
    :param minimum: smallest value allowed.
    :param maximum: largest value allowed.
    :param choices: the texts allowed.
    :param fixed: whether it is read when a node is configured, and may change only before.
    :param read_only: whether it is read when a node starts, and may never change.
    :param names: texts that have a meaning, where others are allowed, too.
    """
    kind = type(default)
    about = Parameter(
        '', kind, default, description, unit, minimum, maximum, choices, fixed, read_only, names
    )
    return dataclasses.field(default=default, metadata={_KEY: about})


def parameters_of(config: type[StageConfig] | StageConfig) -> tuple[Parameter, ...]:
    """List the parameters of a stage in the order of their declaration."""
    return tuple(
        dataclasses.replace(field.metadata[_KEY], name=field.name)
        for field in dataclasses.fields(config)
    )


@dataclass(frozen=True)
class StageConfig:
    """Base of the stages' configurations: checks every field against its declaration."""

    def __post_init__(self) -> None:
        """Put in what fields stand for; ConfigError at the first that is not allowed."""
        for about in parameters_of(self):
            value = about.meant(getattr(self, about.name))
            about.check(value)
            object.__setattr__(self, about.name, value)


def stages_of(config: Any) -> dict[str, StageConfig]:
    """Return the stages' configurations of a pipeline's by name."""
    return {field.name: getattr(config, field.name) for field in dataclasses.fields(config)}


def replaced(config: Stages, stage: str, name: str, value: Any) -> Stages:
    """Return a pipeline's configuration with one parameter changed."""
    changed = dataclasses.replace(stages_of(config)[stage], **{name: value})
    return dataclasses.replace(config, **{stage: changed})  # type: ignore[type-var]


def overridden(config: Stages, settings: Iterable[str]) -> Stages:
    """
    Return a pipeline's configuration with settings such as ``segmentation.contrast=3`` applied.

    The stage may be left out where only one has such a parameter.

    :raises ConfigError: if a setting is malformed, unknown or out of range; the message names
        what there is.
    """
    known = {
        f'{stage}.{about.name}': about
        for stage, each in stages_of(config).items()
        for about in parameters_of(each)
    }
    for setting in settings:
        given, equals, text = map(str.strip, setting.partition('='))
        found = [full for full in known if given in (full, full.partition('.')[2])]
        if not equals:
            raise ConfigError(f'a setting must be STAGE.PARAMETER=VALUE, got {setting!r}')
        if len(found) != 1:
            alike = found or difflib.get_close_matches(given, known, n=3, cutoff=0.0)
            raise ConfigError(f'{given!r} is not the name of one parameter: {", ".join(alike)}?')
        stage, _, name = found[0].partition('.')
        config = replaced(config, stage, name, known[found[0]].parsed(text))
    return config
