# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

from dataclasses import FrozenInstanceError, dataclass, field, replace

import pytest

from gait_segmentation.config import StageConfig, overridden, parameter
from gait_segmentation.detector.networks import DetectorConfig
from gait_segmentation.errors import ConfigError, GaitSegmentationError


@dataclass(frozen=True)
class Example(StageConfig):
    """An example."""

    count: int = parameter(3, 'How many.', minimum=1, maximum=9)
    share: float = parameter(0.5, 'How much.', unit='m', minimum=0.0)
    mode: str = parameter('a', 'Which.', choices=('a', 'b'))
    use_it: bool = parameter(True, 'Whether.')


@dataclass(frozen=True)
class Tracking(StageConfig):
    gain: float = parameter(0.5, 'How much.', minimum=0.0, maximum=1.0)
    use_colour: bool = parameter(True, 'Whether.')


@dataclass(frozen=True)
class Matching(StageConfig):
    lag: int = parameter(0, 'How late.', minimum=0, maximum=10)
    use_colour: bool = parameter(True, 'Whether.')


@dataclass(frozen=True)
class Stages:
    tracking: Tracking = field(default_factory=Tracking)
    matching: Matching = field(default_factory=Matching)


@dataclass(frozen=True)
class Switched(StageConfig):
    """An example of a choice that can be none."""

    way: str = parameter('a', 'Which.', choices=('a', 'none'))
    file: str = parameter('a', 'Which.', names=('a', 'none'))


@pytest.mark.parametrize('given', ['none', 'off', 'false', False])
def test_off_which_yaml_reads_as_false_is_none(given: object) -> None:
    assert Switched(way=given).way == Switched(file=given).file == 'none'
    assert DetectorConfig(network=given).network == 'none'
    with pytest.raises(ConfigError, match='way must be one of a, none, got True'):
        Switched(way=True)


@pytest.mark.parametrize(
    ('values', 'message'),
    [
        ({'count': 0}, 'count must be an integer from 1 to 9, got 0'),
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


def test_integers_are_taken_for_floats_and_changes_are_checked() -> None:
    config = Example(share=2)
    assert config.share == 2.0
    assert isinstance(config.share, float)
    with pytest.raises(ConfigError):
        replace(config, count=100)
    with pytest.raises(FrozenInstanceError):
        config.count = 4  # type: ignore[misc]
    # The limits themselves are allowed.
    assert [Tracking(gain=gain).gain for gain in (0.0, 1.0)] == [0.0, 1.0]


def test_settings_are_applied_in_order():
    config = overridden(
        Stages(),
        ['tracking.gain=0.25', 'matching.lag=3', 'tracking.use_colour=false', 'lag = 4'],
    )
    assert config.tracking.gain == 0.25
    assert config.matching.lag == 4
    assert config.tracking.use_colour is False
    assert overridden(config, []) == config


@pytest.mark.parametrize(
    ('setting', 'message'),
    [
        ('tracking.gain', "must be STAGE.PARAMETER=VALUE, got 'tracking.gain'"),
        ('walking.lag=1', "'walking.lag' is not the name of one parameter: matching.lag, "),
        ('tracking.grain=1', "'tracking.grain' is not the name of one parameter: tracking.gain, "),
        ('use_colour=1', r'one parameter: tracking.use_colour, matching.use_colour\?'),
        ('tracking.gain=2', 'gain must be a number from 0 to 1, got 2.0'),
        ('tracking.gain=much', "gain must be a number from 0 to 1, got 'much'"),
        ('tracking.use_colour=2', "use_colour must be true or false, got '2'"),
    ],
)
def test_settings_that_cannot_be_used_are_refused(setting, message):
    with pytest.raises(ConfigError, match=message):
        overridden(Stages(), [setting])
