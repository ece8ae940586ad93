# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import pytest

from gait_segmentation.streams.config import misnamed

KNOWN = ['max_people', 'backlog', 'initial_box', 'tracking.use_background', 'tracking.memory']


@pytest.mark.parametrize(
    ('given', 'meant'),
    [
        ('max_peeple', 'max_people'),
        ('tracking.use_backgrund', 'tracking.use_background'),
        ('tracking.nothing_of_the_kind', ''),
        ('traking.memory', 'tracking.memory'),
        ('traking.memori', 'tracking.memory'),
    ],
)
def test_what_is_nearly_a_parameter_is_found(given, meant):
    assert misnamed(['backlog', given], KNOWN) == {given: meant}


@pytest.mark.parametrize(
    'given',
    [
        'use_sim_time',
        'matching.lag',
        'matching.backlog',
        'qos_overrides./image.subscription.depth',
        'backlog',
    ],
)
def test_parameters_of_others_and_of_ros_are_no_mistakes(given):
    assert misnamed([given], KNOWN) == {}
