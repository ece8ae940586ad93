# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import math

import numpy as np
import pytest

from gait_segmentation.matching.steady import SteadyAngle


def test_averages_over_the_turn():
    rng = np.random.default_rng(0)
    steady = SteadyAngle()
    found = [
        steady.update(math.remainder(math.pi + rng.normal(0, 0.2), 2 * math.pi), 0.04 * k)
        for k in range(100)
    ]
    assert np.abs(np.abs(found[30:]) - math.pi).max() < 0.15


def test_follows_slow_turns_and_takes_jumps_at_once():
    steady = SteadyAngle()
    for k in range(100):
        last = steady.update(0.005 * k, 0.04 * k)
    assert last == pytest.approx(0.005 * 99, abs=0.1)
    assert steady.update(-1.0, 4.0) == pytest.approx(-1.0)
    steady.reset()
    assert steady.update(-1.3, 0.0) == pytest.approx(-1.3)
