# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest
from hypothesis import example, given, strategies as st

from gait_segmentation.matching.confidence import phase_near

PHASES = 30


def test_a_clear_phase_and_its_twin_are_trusted_more_than_a_flat_belief():
    clear = np.full(PHASES, 1e-5)
    clear[[3, 18]] = 0.5
    phase, sure = phase_near(clear / clear.sum(), 0.12)
    assert phase == pytest.approx(0.1, abs=1e-3)
    _, doubtful = phase_near(np.full(PHASES, 1 / PHASES), 0.1)
    assert doubtful == pytest.approx(0.2)
    assert 0.98 < sure <= 1


def test_of_two_halves_the_nearer_one_is_taken():
    belief = np.zeros(PHASES)
    belief[[3, 18]] = 0.5
    assert phase_near(belief, 0.65)[0] == pytest.approx(0.6)
    belief[[3, 18]] = 0.8, 0.2
    assert phase_near(belief, 0.65)[0] == pytest.approx(0.6)
    # ... unless the belief is clearly in the other one.
    belief[[3, 18]] = 1 - 1e-6, 1e-6
    assert phase_near(belief, 0.65)[0] == pytest.approx(0.1)
    belief[:] = 0
    belief[29] = 1.0
    assert phase_near(belief, 0.03)[0] == pytest.approx(29 / 30)


def test_phases_lie_between_bins():
    belief = np.zeros(PHASES)
    belief[[6, 7]] = 0.25, 0.75
    assert phase_near(belief, 0.2)[0] == pytest.approx(6.75 / PHASES, abs=1e-3)


@given(st.lists(st.floats(0, 1), min_size=PHASES, max_size=PHASES), st.floats(-9, 9))
@example([1.0, *[0.0] * (PHASES - 1)], 0.0)
@example([0.0, *[1.0] * (PHASES - 1)], 1e-17)
def test_phase_and_probability_are_shares(weights, phase):
    belief = np.array(weights) + 1e-9
    found, sure = phase_near(belief / belief.sum(), phase)
    assert 0 <= found < 1
    assert 0 <= sure <= 1 + 1e-9
