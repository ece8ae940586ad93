# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from benchmarks.synthetic.clothing import make_outfit
from benchmarks.synthetic.walkers import (
    STRIDE_LENGTH,
    Straight,
    Walker,
    Whereabouts,
    draw_walker,
)
from gait_segmentation.geometry import BodyFrame

HERE = Whereabouts(0.0, 3.0, 0.0, 0.25)


def walker(azimuth=0.0):
    outfit = make_outfit(np.random.default_rng(0))
    return Walker(Straight(0.0, 3.0, azimuth, 1.0, 0.25), 'average', outfit)


def test_phases():
    assert walker().at(0.5).phase == 0.75
    assert walker().near_phase(0.5) == 0.75
    assert walker(azimuth=3.0).near_phase(0.5) == 0.25


def test_straight_on():
    motion = Straight(1.0, 3.0, 0.0, 1.0, 0.25)
    assert motion.at(0.0).x == 1.0
    assert motion.at(0.5).x == pytest.approx(1 + STRIDE_LENGTH / 2)
    away = Straight(0.0, 3.0, np.pi / 2, 1.0, 0.0).at(1.0)
    assert away.x == pytest.approx(0)
    assert away.z == pytest.approx(3 + STRIDE_LENGTH)


def test_the_body_stands_where_it_should():
    picture = np.zeros((120, 100, 3), np.float32)
    cover = draw_walker(picture, walker(), BodyFrame(50.3, 60.6, 80), HERE, shadow=False)
    rows = np.flatnonzero((cover > 0.5).any(axis=1))
    assert rows[0] == pytest.approx(20.6, abs=3)
    assert rows[-1] + 1 == pytest.approx(100.6, abs=3)
    assert np.abs(np.average(np.arange(100) + 0.5, weights=cover.sum(axis=0)) - 50.3) < 4
    assert picture[cover > 0.9].min() >= 0
    assert not picture[cover == 0].any()


@pytest.mark.parametrize('x', [-200, -5, 105, 300])
def test_walkers_may_be_partly_or_wholly_outside(x):
    picture = np.full((60, 100, 3), 90, np.float32)
    cover = draw_walker(picture, walker(), BodyFrame(x, 30, 80), HERE, shadow=True)
    assert cover.shape == (60, 100)
    assert cover.any() == (abs(x - 50) < 100)
