# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import pytest

from gait_segmentation.streams.config import misnamed

KNOWN = ['max_people', 'backlog', 'initial_box', 'tracking.use_background', 'tracking.memory']


@pytest.mark.parametrize(
    ('given', 'found'),
    [
        ('max_peeple', {'max_peeple': 'max_people'}),
        ('tracking.use_backgrund', {'tracking.use_backgrund': 'tracking.use_background'}),
        ('tracking.nothing_of_the_kind', {'tracking.nothing_of_the_kind': ''}),
        ('traking.memori', {'traking.memori': 'tracking.memory'}),
        ('use_background', {'use_background': 'tracking.use_background'}),
        # Those of ROS and of others.
        *((name, {}) for name in ('use_sim_time', 'matching.lag', 'matching.memory', 'lag')),
        ('qos_overrides./image.subscription.backlog', {}),
    ],
)
def test_what_is_nearly_a_parameter_is_found(given: str, found: dict[str, str]) -> None:
    assert misnamed(['backlog', given], KNOWN) == found
