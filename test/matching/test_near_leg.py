# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import math

import pytest
from hypothesis import given, strategies as st

from gait_segmentation.matching.near_leg import NearLeg


@pytest.mark.parametrize(
    ('degrees', 'swap'), [(0, 0.0), (60, 0.0), (180, 0.5), (-150, 0.5), (100, 0.5), (270, 0.0)]
)
def test_the_near_leg_is_the_right_one_of_somebody_walking_to_the_right(degrees, swap):
    assert NearLeg().update(0.3, math.radians(degrees), 0.0) == pytest.approx(0.3 + swap)


def test_a_view_that_wavers_about_the_axis_keeps_its_leg():
    near = NearLeg()
    views = [70, 80, 88, 95, 100, 85, 110, 92, -100, -80]
    found = [near.update(0.02 * k, math.radians(view), 0.1 * k) for k, view in enumerate(views)]
    assert found == pytest.approx([0.02 * k for k in range(len(views))])


def test_who_turns_to_the_other_side_changes_legs_once():
    near = NearLeg()
    found = [near.update(0.02 * k, math.radians(10 * k), 0.1 * k) for k in range(19)]
    swapped = [abs(value - 0.02 * k) > 0.25 for k, value in enumerate(found)]
    assert swapped == [k > 12 for k in range(19)]


def test_waits_for_a_phase_behind_and_takes_a_jump():
    near = NearLeg()
    assert [near.update(phase, 0.0, 0.0) for phase in (0.5, 0.4, 0.45, 0.52)] == [
        0.5,
        0.5,
        0.5,
        0.52,
    ]
    assert near.update(0.02, 0.0, 0.0) == 0.02
    near.reset()
    assert near.update(0.9, 0.0, 0.0) == 0.9
    assert near.update(0.1, 0.0, 0.0) == pytest.approx(0.1)


def test_expects_a_steady_walk():
    near = NearLeg()
    assert near.expected(0.0, 1.0) is None
    near.update(0.7, math.pi, 2.0)
    assert near.expected(2.1, 0.9) == pytest.approx(0.79)
    near.reset()
    assert near.expected(3.0, 0.9) is None


@given(
    st.lists(
        st.tuples(st.floats(0, 1, exclude_max=True), st.floats(-math.pi, math.pi)), max_size=9
    )
)
def test_phases_are_shares_of_a_stride(walk):
    near = NearLeg()
    for number, (phase, azimuth) in enumerate(walk):
        assert 0 <= near.update(phase, azimuth, 0.1 * number) < 1
