# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

from dataclasses import FrozenInstanceError, dataclass, replace

import pytest

from gait_segmentation.config import StageConfig, parameter, parameters_of
from gait_segmentation.errors import ConfigError, GaitSegmentationError


@dataclass(frozen=True)
class Example(StageConfig):
    """An example."""

    count: int = parameter(3, 'How many.', minimum=1, maximum=9)
    share: float = parameter(0.5, 'How much.', unit='m', minimum=0.0)
    mode: str = parameter('a', 'Which.', choices=('a', 'b'))
    use_it: bool = parameter(True, 'Whether.')


def test_declaration_is_the_source_of_everything_known() -> None:
    about = {each.name: each for each in parameters_of(Example)}
    assert list(about) == ['count', 'share', 'mode', 'use_it']
    assert about['count'].type is int
    assert about['count'].maximum == 9
    assert about['share'].unit == 'm'
    assert about['mode'].choices == ('a', 'b')


def test_integers_are_taken_for_floats() -> None:
    config = Example(share=2)
    assert config.share == 2.0
    assert isinstance(config.share, float)


@dataclass(frozen=True)
class Switched(StageConfig):
    """An example of a choice that can be none."""

    way: str = parameter('a', 'Which.', choices=('a', 'none'))


@pytest.mark.parametrize('given', ['none', 'off', 'false', False])
def test_off_which_yaml_reads_as_false_is_none(given: object) -> None:
    assert Switched(way=given).way == 'none'


@pytest.mark.parametrize('given', [True, 'on', 0])
def test_nothing_else_is_none(given: object) -> None:
    with pytest.raises(ConfigError, match='way must be one of a, none, got'):
        Switched(way=given)


@pytest.mark.parametrize(
    ('values', 'message'),
    [
        ({'count': 0}, 'count must be an integer from 1 to 9, got 0'),
        ({'count': 10}, 'count must be an integer from 1 to 9, got 10'),
        ({'count': 2.0}, 'count must be an integer from 1 to 9, got 2.0'),
        ({'count': True}, 'count must be an integer from 1 to 9, got True'),
        ({'share': -1.0}, 'share must be a number of at least 0, got -1.0'),
        ({'share': float('nan')}, 'share must be a number of at least 0, got nan'),
        ({'share': 'much'}, "share must be a number of at least 0, got 'much'"),
        ({'share': 10**400}, 'share must be a number of at least 0, got inf'),
        ({'mode': False}, 'mode must be one of a, b, got False'),
        ({'mode': 'c'}, "mode must be one of a, b, got 'c'"),
        ({'use_it': 1}, 'use_it must be true or false, got 1'),
    ],
)
def test_what_is_not_allowed_is_refused_with_value_and_range(values: dict, message: str) -> None:
    with pytest.raises(ConfigError) as caught:
        Example(**values)
    assert str(caught.value) == message
    assert isinstance(caught.value, GaitSegmentationError)


def test_changes_go_through_the_same_check() -> None:
    config = Example()
    with pytest.raises(ConfigError):
        replace(config, count=100)
    with pytest.raises(FrozenInstanceError):
        config.count = 4  # type: ignore[misc]
