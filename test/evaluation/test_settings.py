# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import pytest

from gait_segmentation.errors import ConfigError
from gait_segmentation.evaluation.settings import overridden, replaced, stages_of

from .fakes import FakePipelineConfig


def test_settings_are_applied_in_order():
    config = overridden(
        FakePipelineConfig(),
        ['tracking.gain=0.25', 'matching.lag=3', 'tracking.use_colour=false', 'matching.lag = 4'],
    )
    assert config.tracking.gain == 0.25
    assert config.matching.lag == 4
    assert config.tracking.use_colour is False
    assert overridden(config, []) == config


@pytest.mark.parametrize(
    ('setting', 'message'),
    [
        ('tracking.gain', "must be STAGE.PARAMETER=VALUE, got 'tracking.gain'"),
        ('gain=1', 'must be STAGE.PARAMETER=VALUE'),
        ('walking.gain=1', 'one of tracking, matching, segmentation'),
        ('tracking.grain=1', "tracking has no parameter 'grain', but gain"),
        ('tracking.else=1', "tracking has no parameter 'else', but gain, use_colour"),
        ('tracking.gain=2', 'gain must be a number from 0 to 1, got 2.0'),
        ('tracking.gain=much', "gain must be a number from 0 to 1, got 'much'"),
        ('tracking.use_colour=2', "use_colour must be true or false, got '2'"),
        ('matching.lag=1.5', "lag must be an integer from 0 to 10, got '1.5'"),
        ('segmentation.prior=hard', 'prior must be one of none, distance, default'),
    ],
)
def test_settings_that_cannot_be_used_are_refused(setting, message):
    with pytest.raises(ConfigError, match=message):
        overridden(FakePipelineConfig(), [setting])


def test_replaced_leaves_the_other_stages_alone():
    config = FakePipelineConfig()
    changed = replaced(config, 'matching', 'lag', 2)
    assert stages_of(changed)['tracking'] is config.tracking
    assert changed.matching.lag == 2
