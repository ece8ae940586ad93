# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import math

import numpy as np
import pytest

from gait_segmentation.gait_model import TemplateBank
from gait_segmentation.matching import MatchingConfig
from gait_segmentation.matching.transitions import UNIT, phase_costs, turned, view_changes


def test_steps_reach_from_standing_to_the_fastest_walk():
    costs = phase_costs(30, 1 / 30, 0.95, 4 / 3, 0.3)
    assert len(costs) == 3
    assert costs.argmin() == 1
    assert costs[0] == round(UNIT * 0.3 * 0.95 / 30)
    assert len(phase_costs(30, 0.5, 0.95, 4 / 3, 0.3)) == 21
    assert len(phase_costs(30, 9.0, 0.95, 4 / 3, 0.3)) == 30
    assert len(phase_costs(30, 1e-3, 0.95, 4 / 3, 0.3)) == 2


def test_turns_to_neighbours_and_changes_build_in_place():
    azimuth = np.array([0, math.pi / 2, math.pi, -math.pi / 2, 0], np.float32)
    bank = TemplateBank(np.zeros((5, 2, 4, 4), np.uint8), azimuth, ('a', 'a', 'a', 'a', 'b'), 0.9)
    near, cost = view_changes(bank, MatchingConfig(view_cost=0.1, build_cost=0.2))
    found = [
        {int(v): int(c) for v, c in zip(*row, strict=True) if v >= 0}
        for row in zip(near, cost, strict=True)
    ]
    turn, change = round(0.1 * UNIT), round(0.2 * UNIT)
    assert found[0] == {1: turn, 3: turn, 4: change}
    assert found[2] == {1: turn, 3: turn}
    assert found[4] == {0: change}


def test_angles_are_wrapped():
    assert turned(1.5 * math.pi) == pytest.approx(-0.5 * math.pi)
