# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Hostile requests to the services of the nodes."""

from __future__ import annotations

import math
from collections.abc import Iterator

from hostile.kinds import Aim, Call, kind
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from std_srvs.srv import SetBool, Trigger

from benchmarks.nodes import MODULES

__all__ = ['TYPES']

TYPES = {
    'set_parameters': SetParameters,
    'set_parameters_atomically': SetParametersAtomically,
    'get_parameters': GetParameters,
    'describe_parameters': DescribeParameters,
    'list_parameters': ListParameters,
    'enable': SetBool,
    'reset': Trigger,
    'change_state': ChangeState,
    'get_state': GetState,
}
"""Type of each service that is called."""

_NAMES = (
    'backlog', 'autostart', 'max_people', 'initial_box', 'bank', 'reliability', 'use_sim_time ',
    'tracking.working_height', 'tracking.use_texture', 'matching.window', 'segmentation.prior',
    'starting.auto_init', 'no_such', '', '.', 'a' * 10_000, 'tracking', '🙂', 'matching.window.x',
)  # fmt: skip
_VALUES = (
    ParameterValue(),
    ParameterValue(type=1, bool_value=True),
    *(ParameterValue(type=2, integer_value=value) for value in (-(2**63), 2**63 - 1)),
    *(
        ParameterValue(type=3, double_value=value)
        for value in (math.nan, math.inf, -math.inf, 1e308, -1.0)
    ),
    *(ParameterValue(type=4, string_value=value) for value in ('magic', 'x' * 20_000)),
    ParameterValue(type=5, byte_array_value=[b'\0', b'\xff']),
    ParameterValue(type=6, bool_array_value=[True] * 9),
    ParameterValue(type=7, integer_array_value=[2**40] * 9),
    ParameterValue(type=8, double_array_value=[math.nan] * 4),
    ParameterValue(type=9, string_array_value=['', 'x']),
    *(ParameterValue(type=number, double_value=math.nan) for number in (10, 77, 255)),
)
"""None of which any parameter takes, apart from a switch that is on already."""


def _node(aim: Aim) -> str:
    return str(aim.one_of(MODULES))


@kind('parameters: set to what is not allowed')
def _set(aim: Aim) -> Iterator[Call]:
    name = aim.one_of(('set_parameters', 'set_parameters_atomically'))
    settings = [
        Parameter(name=aim.one_of(_NAMES), value=aim.one_of(_VALUES))
        for _ in range(aim.one_of((0, 1, 1, 1, 1, 4, 4, 200)))
    ]
    yield Call(_node(aim), name, TYPES[name].Request(parameters=settings))


@kind('parameters: asked for, declared or not', 0.5)
def _ask(aim: Aim) -> Iterator[Call]:
    names = [aim.one_of(_NAMES) for _ in range(aim.one_of((0, 1, 30)))]
    yield Call(_node(aim), 'get_parameters', GetParameters.Request(names=names))
    yield Call(_node(aim), 'describe_parameters', DescribeParameters.Request(names=names))
    request = ListParameters.Request(prefixes=names, depth=aim.one_of((0, 1, 2**63)))
    yield Call(_node(aim), 'list_parameters', request)


@kind('enable: off and on', 0.1)
def _enable(aim: Aim) -> Iterator[Call]:
    node = _node(aim)
    for on in aim.one_of(((False, True), (True, True), (False, False, True))):
        yield Call(node, 'enable', SetBool.Request(data=on), pauses=True)


@kind('reset', 0.2)
def _reset(aim: Aim) -> Iterator[Call]:
    node = _node(aim)
    for _ in range(aim.one_of((1, 1, 10))):
        yield Call(node, 'reset', Trigger.Request())


@kind('life cycle: transitions that there are not', 0.3)
def _impossible(aim: Aim) -> Iterator[Call]:
    node = _node(aim)
    number = aim.one_of((Transition.TRANSITION_CREATE, Transition.TRANSITION_DESTROY,
                         Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE,
                         Transition.TRANSITION_CLEANUP, 10, 30, 61, 200, 255))  # fmt: skip
    label = aim.one_of(('', 'magic', 'a' * 10_000))
    request = ChangeState.Request(transition=Transition(id=number, label=label))
    yield Call(node, 'change_state', request)
    yield Call(node, 'get_state', GetState.Request())


def _go(node: str, *numbers: int) -> Iterator[Call]:
    for number in numbers:
        request = ChangeState.Request(transition=Transition(id=number))
        yield Call(node, 'change_state', request, pauses=True)


@kind('life cycle: inactive and active again', 0.03)
def _cycle(aim: Aim) -> Iterator[Call]:
    yield from _go(_node(aim), Transition.TRANSITION_DEACTIVATE, Transition.TRANSITION_ACTIVATE)


@kind('life cycle: configured anew', 0.005)
def _whole_cycle(aim: Aim) -> Iterator[Call]:
    yield from _go(
        _node(aim),
        Transition.TRANSITION_DEACTIVATE,
        Transition.TRANSITION_CLEANUP,
        Transition.TRANSITION_CONFIGURE,
        Transition.TRANSITION_ACTIVATE,
    )
