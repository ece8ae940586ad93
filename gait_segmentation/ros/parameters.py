# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""ROS parameters made from the configuration dataclasses, and the dataclasses from them."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    ParameterType,
    SetParametersResult,
)
from rclpy.parameter import Parameter as RclpyParameter

from gait_segmentation.config import Parameter, StageConfig, parameters_of
from gait_segmentation.errors import ConfigError
from gait_segmentation.streams.config import misnamed, qualified

Config = TypeVar('Config', bound=StageConfig)

_FIXED = 'Can be changed only while the node is unconfigured.'

_TYPES = {
    bool: ParameterType.PARAMETER_BOOL,
    int: ParameterType.PARAMETER_INTEGER,
    float: ParameterType.PARAMETER_DOUBLE,
    str: ParameterType.PARAMETER_STRING,
    tuple: ParameterType.PARAMETER_DOUBLE_ARRAY,
}


def descriptor(about: Parameter) -> ParameterDescriptor:
    """Describe a parameter to ROS: type, text with unit and choices, range, when it may change."""
    text = about.description + (f' Unit: {about.unit}.' if about.unit else '')
    made = ParameterDescriptor(
        name=about.name,
        type=_TYPES[about.type],
        description=text,
        additional_constraints=f'Must be {about.allowed()}.' + f' {_FIXED}' * about.fixed,
        read_only=about.read_only,
    )
    if about.minimum is not None and about.maximum is not None:
        if about.type is int:
            made.integer_range = [
                IntegerRange(from_value=int(about.minimum), to_value=int(about.maximum), step=1)
            ]
        elif about.type is float:
            made.floating_point_range = [
                FloatingPointRange(
                    from_value=float(about.minimum), to_value=float(about.maximum), step=0.0
                )
            ]
    return made


class NodeParameters:
    """
    The parameters of a node as frozen configurations, changed as a whole or not at all.

    ``configs`` maps the group (the stage's name, empty for the node's own) and the class to the
    configuration in force.
    """

    def __init__(
        self,
        node: Any,
        groups: Sequence[tuple[str, type[StageConfig]]],
        *,
        changed: Callable[[StageConfig], None],
    ) -> None:
        """
        Declare the parameters and read their first values.

        :param node: a :class:`GaitNode`.
        :param groups: prefix and configuration class.
        :param changed: called with a new configuration after a change.
        :raises ConfigError: if a value is not allowed.
        """
        self._node = node
        self._groups = tuple(groups)
        self._changed = changed
        self._abouts = {
            qualified(group, about.name): about
            for group, kind in self._groups
            for about in parameters_of(kind)
        }
        values = {name: self._declared(name, about) for name, about in self._abouts.items()}
        self._configs = self._made(values)
        node.set_parameters_atomically(
            [RclpyParameter(name, value=value) for name, value in values.items()]
        )
        for name, about in self._abouts.items():
            node.set_descriptor(name, descriptor(about))
        # In files or on the command line; rclpy leaves out without a word what is not declared.
        with node.handle:
            given = list(node.handle.get_parameters(RclpyParameter))
        for name, meant in misnamed(given, values).items():
            hint = f': did you mean {meant}?' if meant else ''
            node.get_logger().warning(f'there is no parameter {name}{hint}')
        node.add_pre_set_parameters_callback(self._read)
        node.add_on_set_parameters_callback(self._check)
        node.add_post_set_parameters_callback(self._swap)

    def _declared(self, name: str, about: Parameter) -> Any:
        """
        Declare a parameter, for now of any type, and return what its value stands for.

        With its own type, rclpy would refuse 1 for 1.0.
        """
        free = ParameterDescriptor(dynamic_typing=True)
        return about.meant(self._node.declare_parameter(name, about.default, free).value)

    def get(self, kind: type[Config]) -> Config:
        """Return the configuration of a class that is in force."""
        config = self._configs[kind]
        assert isinstance(config, kind)
        return config

    def _made(self, values: Mapping[str, Any]) -> dict[type[StageConfig], StageConfig]:
        """Make all configurations from those in force and some new values."""
        made: dict[type[StageConfig], StageConfig] = {}
        for group, kind in self._groups:
            names = {qualified(group, about.name): about.name for about in parameters_of(kind)}
            changes = {names[name]: value for name, value in values.items() if name in names}
            base = getattr(self, '_configs', {}).get(kind)
            try:
                made[kind] = dataclasses.replace(base, **changes) if base else kind(**changes)
            except ConfigError as error:
                raise ConfigError(f'{group}: {error}' if group else str(error)) from error
        return made

    def _read(self, parameters: list[RclpyParameter]) -> list[RclpyParameter]:
        """Put in what the values stand for."""
        read = []
        for each in parameters:
            about = self._abouts.get(each.name)
            meant = each.value if about is None else about.meant(each.value)
            read.append(each if meant is each.value else RclpyParameter(each.name, value=meant))
        return read

    def _check(self, parameters: list[RclpyParameter]) -> SetParametersResult:
        try:
            self._refuse_fixed(parameters)
            self._made({each.name: each.value for each in parameters})
        except ConfigError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _refuse_fixed(self, parameters: list[RclpyParameter]) -> None:
        """
        Refuse to change what the node has been configured with.

        :raises ConfigError: if something else than it has is given, and it is not unconfigured.
        """
        state = self._node.state
        for each in parameters:
            about = self._abouts.get(each.name)
            if about is None or not about.fixed or state == 'unconfigured':
                continue
            now = self._node.get_parameter(each.name).get_parameter_value()
            if each.get_parameter_value() != now:
                raise ConfigError(
                    f'{each.name} is read when the node is configured, and it is {state}: '
                    'deactivate it and clean it up first'
                )

    def _swap(self, parameters: list[RclpyParameter]) -> None:
        before = self._configs
        self._configs = self._made({each.name: each.value for each in parameters})
        for kind, config in self._configs.items():
            if config != before[kind]:
                self._changed(config)
