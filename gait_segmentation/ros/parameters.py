# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""ROS parameters made from the configuration dataclasses, and the dataclasses from them."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    ParameterType,
    SetParametersResult,
)
from rclpy.parameter import Parameter as RclpyParameter

from gait_segmentation.config import Parameter, StageConfig, parameters_of
from gait_segmentation.errors import ConfigError, GaitSegmentationError
from gait_segmentation.geometry import Box
from gait_segmentation.ros.names import misnamed, qualified

if TYPE_CHECKING:
    from rclpy.node import Node

__all__ = [
    'INITIAL_BOX',
    'NodeParameters',
    'descriptor',
    'given_parameters',
    'read_initial_box',
]

INITIAL_BOX = Parameter(
    'initial_box',
    list,
    [0.0, 0.0, 0.0, 0.0],
    'Tight box of the person to track from the beginning: x and y of the top left corner, width '
    'and height. All zero = wait for init_roi.',
    'px',
    None,
    None,
    None,
    True,
)
"""The one parameter that is a list; it stands beside :class:`StartConfig`."""

Config = TypeVar('Config', bound=StageConfig)

_TYPES = {
    bool: ParameterType.PARAMETER_BOOL,
    int: ParameterType.PARAMETER_INTEGER,
    float: ParameterType.PARAMETER_DOUBLE,
    str: ParameterType.PARAMETER_STRING,
    list: ParameterType.PARAMETER_DOUBLE_ARRAY,
}


def descriptor(about: Parameter) -> ParameterDescriptor:
    """Describe a parameter to ROS: type, text with unit and choices, range, read-only."""
    text = about.description + (f' Unit: {about.unit}.' if about.unit else '')
    made = ParameterDescriptor(
        name=about.name,
        type=_TYPES[about.type],
        description=text,
        additional_constraints=_constraints(about),
        read_only=about.read_only,
        # 1 instead of 1.0 in a YAML file is a number as well.
        dynamic_typing=about.type in (float, list),
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


def _constraints(about: Parameter) -> str:
    if about.type is list:
        return 'Must be 4 finite numbers.'
    return f'Must be {about.allowed()}.'


def given_parameters(node: Node) -> list[str]:
    """Return the names of the parameters given to a node, in files or on the command line."""
    with node.handle:
        return list(node.handle.get_parameters(RclpyParameter))


def read_initial_box(values: Sequence[float]) -> Box | None:
    """
    Return the box that the parameter ``initial_box`` holds, None if it is all zero.

    :raises ConfigError: if it does not hold four numbers that make a box.
    """
    numbers = [value for value in values if isinstance(value, int | float)]
    if len(values) != 4 or len(numbers) != 4 or not all(math.isfinite(n) for n in numbers):
        raise ConfigError(f'initial_box must be 4 finite numbers, got {list(values)}')
    if not any(numbers):
        return None
    try:
        return Box(*(float(number) for number in numbers))
    except GaitSegmentationError as error:
        raise ConfigError(f'initial_box: {error}') from error


class NodeParameters:
    """
    The parameters of a node as frozen configurations, changed as a whole or not at all.

    ``configs`` maps the group (the stage's name, empty for the node's own) and the class to the
    configuration in force.
    """

    def __init__(
        self,
        node: Node,
        groups: Sequence[tuple[str, type[StageConfig]]],
        *,
        with_initial_box: bool = False,
        changed: Callable[[str, StageConfig], None],
    ) -> None:
        """
        Declare the parameters and read their first values.

        :param groups: prefix and configuration class.
        :param with_initial_box: whether to declare ``initial_box`` as well.
        :param changed: called with prefix and new configuration after a change.
        :raises ConfigError: if a value is not allowed.
        """
        self._groups = tuple(groups)
        self._changed = changed
        values: dict[str, Any] = {}
        for group, kind in self._groups:
            for about in parameters_of(kind):
                name = qualified(group, about.name)
                values[name] = node.declare_parameter(name, about.default, descriptor(about)).value
        self._configs = self._made(values)
        self.initial_box: Box | None = None
        if with_initial_box:
            box = INITIAL_BOX
            self.initial_box = read_initial_box(
                node.declare_parameter(box.name, box.default, descriptor(box)).value
            )
            values[box.name] = box.default
        # rclpy leaves out without a word what is not declared.
        for name, meant in misnamed(given_parameters(node), values).items():
            hint = f': did you mean {meant}?' if meant else ''
            node.get_logger().warning(f'there is no parameter {name}{hint}')
        node.add_on_set_parameters_callback(self._check)
        node.add_post_set_parameters_callback(self._swap)

    def get(self, kind: type[Config]) -> Config:
        """Return the configuration of a class that is in force."""
        config = self._configs[kind]
        assert isinstance(config, kind)
        return config

    def _made(self, values: Mapping[str, Any]) -> dict[type[StageConfig], StageConfig]:
        """Make all configurations anew from those in force and some new values."""
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

    def _check(self, parameters: list[RclpyParameter]) -> SetParametersResult:
        try:
            self._made({each.name: each.value for each in parameters})
        except ConfigError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _swap(self, parameters: list[RclpyParameter]) -> None:
        before = self._configs
        self._configs = self._made({each.name: each.value for each in parameters})
        for group, kind in self._groups:
            if self._configs[kind] != before[kind]:
                self._changed(group, self._configs[kind])
