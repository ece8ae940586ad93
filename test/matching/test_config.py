# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import pytest

from gait_segmentation.errors import ConfigError
from gait_segmentation.matching import MatchingConfig


@pytest.mark.parametrize(
    'wrong',
    [
        {'lag': -1},
        {'window': 0.0},
        {'memory': float('nan')},
        {'levels': 1},
        {'minimum_cadence': 120.0, 'maximum_cadence': 100.0},
    ],
)
def test_refuses_values_with_their_name(wrong):
    with pytest.raises(ConfigError, match=next(iter(wrong))):
        MatchingConfig(**wrong)


def test_an_unknown_kernel_is_named_with_the_choices() -> None:
    with pytest.raises(ConfigError, match=r"events, direct_access_table, got 'table'"):
        MatchingConfig(kernel='table')
