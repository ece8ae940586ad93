# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import math

import numpy as np
import pytest

from benchmarks.synthetic.courses import STRIDE_LENGTH, Course, Straight
from gait_segmentation.errors import InputError


def course(points, **changes):
    values = {'stride_rate': 1.0, 'phase': 0.1, 'begins': -2.0, 'ends': 4.0, **changes}
    return Course(points=points, **values)


def test_straight_on():
    motion = Straight(1.0, 3.0, 0.0, 1.0, 0.25)
    assert motion.at(0.0).x == 1.0
    assert motion.at(0.5).x == pytest.approx(1 + STRIDE_LENGTH / 2)
    assert motion.at(0.5).phase == 0.75
    away = Straight(0.0, 3.0, math.pi / 2, 1.0, 0.0).at(1.0)
    assert away.x == pytest.approx(0)
    assert away.z == pytest.approx(3 + STRIDE_LENGTH)


def test_a_course_without_turns_is_straight():
    way = course([(0.0, 3.0), (9.0, 3.0)])
    for seconds in (-2.0, -0.5, 1.0, 3.99):
        where = way.at(seconds)
        assert where.x == pytest.approx(STRIDE_LENGTH * (seconds + 2))
        assert (where.z, where.azimuth) == (3.0, 0.0)
        assert where.phase == pytest.approx((0.1 + seconds + 2) % 1, abs=1e-9)
    assert way.at(-5.0).x == 0.0


def test_who_turns_round_comes_back_with_legs_moving_all_the_time():
    way = course([(0.0, 3.0), (1.5, 3.0), (-3.0, 3.0)])
    places = [way.at(seconds) for seconds in np.arange(-2.0, 4.0, 0.04)]
    xs = np.array([where.x for where in places])
    assert xs.max() == pytest.approx(1.5, abs=0.1)
    assert places[-1].x < 0.5
    assert abs(places[-1].azimuth) == pytest.approx(math.pi, abs=0.1)
    assert np.abs(np.diff(xs)).max() < 0.04 * STRIDE_LENGTH * 1.1
    turns = np.diff(np.unwrap([where.azimuth for where in places]))
    assert np.abs(turns).max() < 0.25
    steps = np.diff([where.phase for where in places]) % 1
    assert (steps > 0.01).all()


def test_who_stops_stands_with_the_legs_side_by_side():
    way = course([(0.0, 3.0), (0.8, 3.0), (5.0, 3.0)], stops={1: 2.0})
    standing = [way.at(seconds) for seconds in (0.2, 0.5, 0.9)]
    assert len({where.x for where in standing}) == 1
    assert [where.phase % 0.5 for where in standing] == pytest.approx([0.3] * 3)
    assert way.at(3.0).x > 1.5


def test_courses_that_cannot_be_walked():
    with pytest.raises(InputError, match='at least two points, got 1'):
        course([(0.0, 3.0)])
    with pytest.raises(InputError, match='from 0 to 1, got 2'):
        course([(0.0, 3.0), (1.0, 3.0)], stops={2: 1.0})
