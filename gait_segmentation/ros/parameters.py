# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""ROS parameters made from the configuration dataclasses, and the dataclasses from them."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar, cast

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
        ends = {'from_value': about.type(about.minimum), 'to_value': about.type(about.maximum)}
        if about.type is int:
            made.integer_range = [IntegerRange(**ends, step=1)]
        else:
            made.floating_point_range = [FloatingPointRange(**ends, step=0.0)]
    return made


class NodeParameters:
    """The parameters of a node as frozen configurations, changed as a whole or not at all."""

    def __init__(
        self,
        node: Any,
        groups: Sequence[tuple[str, type[StageConfig]]],
        changed: Callable[[StageConfig], None],
    ) -> None:
        """
        Declare the parameters of a :class:`GaitNode` by prefix, and read their first values.

        :raises ConfigError: if a value is not allowed.
        """
        self._node = node
        self._configs: dict[type[StageConfig], StageConfig] = {}
        self._groups = tuple(groups)
        # Called with each new configuration.
        self._changed = changed
        # In files or on the command line; rclpy leaves out without a word what is not declared.
        with node.handle:
            given = node.handle.get_parameters(RclpyParameter)
        self._abouts = {
            name: about
            for group, kind in self._groups
            for about in parameters_of(kind)
            if (name := qualified(group, about.name)) in given or not about.is_switch
        }
        # For now of any type: with its own, rclpy would refuse 1 for 1.0.
        free = ParameterDescriptor(dynamic_typing=True)
        values = {
            name: about.meant(node.declare_parameter(name, about.default, free).value)
            for name, about in self._abouts.items()
        }
        self._configs = self._made(values)
        node.set_parameters_atomically(
            [RclpyParameter(name, value=value) for name, value in values.items()]
        )
        for name, about in self._abouts.items():
            node.set_descriptor(name, descriptor(about))
        for name, meant in misnamed(given, values).items():
            hint = f': did you mean {meant}?' if meant else ''
            node.get_logger().warning(f'there is no parameter {name}{hint}')
        node.add_pre_set_parameters_callback(self._read)
        node.add_on_set_parameters_callback(self._check)
        node.add_post_set_parameters_callback(self._swap)

    def get(self, kind: type[Config]) -> Config:
        """Return the configuration of a class that is in force."""
        return cast('Config', self._configs[kind])

    def _made(self, values: Mapping[str, Any]) -> dict[type[StageConfig], StageConfig]:
        """Make all configurations from those in force and some new values."""
        made: dict[type[StageConfig], StageConfig] = {}
        for group, kind in self._groups:
            names = {qualified(group, about.name): about.name for about in parameters_of(kind)}
            changes = {names[name]: value for name, value in values.items() if name in names}
            try:
                made[kind] = dataclasses.replace(self._configs.get(kind, kind()), **changes)
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
        state = self._node.state
        for each in parameters:
            about = self._abouts.get(each.name)
            if about is None or not about.fixed or state == 'unconfigured':
                continue
            # What a file that was dumped gives back is no change.
            now = self._node.get_parameter(each.name).get_parameter_value()
            if each.get_parameter_value() != now:
                return SetParametersResult(
                    reason=f'{each.name} is read when the node is configured, and it is {state}: '
                    'deactivate it and clean it up first'
                )
        try:
            self._made({each.name: each.value for each in parameters})
        except ConfigError as error:
            return SetParametersResult(reason=str(error))
        return SetParametersResult(successful=True)

    def _swap(self, parameters: list[RclpyParameter]) -> None:
        before = self._configs
        self._configs = self._made({each.name: each.value for each in parameters})
        for kind, config in self._configs.items():
            if config != before[kind]:
                self._changed(config)
