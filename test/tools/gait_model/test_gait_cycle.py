# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.errors import BankError
from gait_tools.gait_model.gait_cycle import (
    Cycle,
    autocorrelation,
    find_contacts,
    find_step,
)
from gait_tools.gait_model.silhouettes import register_silhouettes
from test.tools.gait_model.test_silhouettes import FILL, GRID, walker


@pytest.fixture(scope='module')
def registered():
    return register_silhouettes(walker(70, 31.0, start=0.1), GRID, FILL)


def test_period(registered):
    assert find_step(registered) == pytest.approx(15.5, abs=0.3)
    values = autocorrelation(registered, 40)
    assert values[0] == pytest.approx(1)
    assert values[31] > 0.8 > 0 > values[8]


def test_period_of_an_oblique_view_where_the_half_cycles_differ():
    oblique = register_silhouettes(walker(90, 30.0, azimuth=np.pi / 4), GRID, FILL)
    assert find_step(oblique, profile=False) == pytest.approx(15, abs=0.5)


def test_contacts(registered):
    cycle = find_contacts(registered, 15.5)
    # The walker starts at phase 0.1: contacts are 0.4, 0.9, ... strides later.
    expected = 31.0 * np.array([0.4, 0.9, 1.4, 1.9])
    assert cycle.contacts == pytest.approx(expected, abs=1.5)


def test_phase_goes_on_before_and_after_the_contacts():
    cycle = Cycle(10.0, np.array([5.0, 15.0, 27.0]))
    phase = cycle.phase(np.array([0.0, 5.0, 10.0, 21.0, 27.0, 37.0]))
    assert phase == pytest.approx([-0.25, 0.0, 0.25, 0.75, 1.0, 1.5])
    assert cycle.phase(np.array([5.0]), 0.5) == pytest.approx(0.5)


def test_too_short_and_without_rhythm(registered):
    with pytest.raises(BankError, match='at least 14 silhouettes, got 9'):
        find_step(registered[:9])
    with pytest.raises(BankError, match='50 silhouettes show no period'):
        find_step(np.repeat(registered[:1], 50, axis=0))
    with pytest.raises(BankError, match='fewer than three heel contacts'):
        find_contacts(registered[:25], 15.5)
