# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from benchmarks.synthetic.props import (
    draw_prop,
    make_car,
    make_pillar,
    make_tree,
)
from gait_segmentation.geometry import BodyFrame


def drawn(prop, seconds=0.0, x=100.0, height=60.0):
    picture = np.full((120, 200, 3), 127, np.float32)
    cover = draw_prop(picture, prop, prop.at(seconds), BodyFrame(x, 60.0, height))
    return picture, cover


def middle(cover, rows=slice(None)):
    return float(np.average(np.arange(cover.shape[1]) + 0.5, weights=cover[rows].sum(axis=0)))


def test_a_pillar_stands_where_it_should_and_covers_everything_there():
    picture, cover = drawn(make_pillar(np.random.default_rng(0), 0.0, 3.0, 0.5, 1.0))
    columns = np.flatnonzero((cover > 0.5).any(axis=0))
    rows = np.flatnonzero((cover > 0.5).any(axis=1))
    assert columns[0] == pytest.approx(85, abs=1)
    assert columns[-1] == pytest.approx(114, abs=1)
    assert rows[0] == pytest.approx(30, abs=1)
    assert rows[-1] == pytest.approx(89, abs=1)
    assert (cover[35:85, 88:112] == 1).all()
    assert (picture[cover == 0] == 127).all()


def test_a_car_drives():
    car = make_car(np.random.default_rng(1), 0.5, 4.0, -2.0)
    assert car.at(0.0).x == 0.5
    assert car.at(1.0).x == -1.5
    _, cover = drawn(car)
    box = np.flatnonzero((cover > 0.5).any(axis=0)).size, np.flatnonzero(cover.any(axis=1)).size
    assert box[0] > 2 * box[1]


def test_a_tree_swings_about_its_foot():
    tree = make_tree(np.random.default_rng(2), 0.0, 3.0, swing=0.3)
    leans = [tree.at(seconds).lean for seconds in np.arange(0, 4, 0.1)]
    assert max(leans) > 0.1
    assert min(leans) < -0.1
    right = drawn(tree, 0.1 * int(np.argmax(leans)))[1]
    left = drawn(tree, 0.1 * int(np.argmin(leans)))[1]
    assert middle(right, slice(20, 50)) > middle(left, slice(20, 50)) + 8
    assert middle(right, slice(86, 90)) == pytest.approx(middle(left, slice(86, 90)), abs=2)
