# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import math

import numpy as np
import pytest

from gait_segmentation.gait_model import TemplateBank
from gait_segmentation.matching.views import FineViews, Views
from gait_tools.gait_model import BankSpec, build_bank

AZIMUTHS = np.array([0, 40, 80, 180, 0, 170], np.float32)


def views():
    builds = ('a', 'a', 'a', 'a', 'b', 'b')
    templates = np.zeros((6, 2, 4, 4), np.uint8)
    return Views(TemplateBank(templates, np.deg2rad(AZIMUTHS), builds, 0.9))


def test_neighbours_are_of_the_same_build_all_the_way_round():
    ring = views()
    assert ring.beside(1) == (0, 2)
    assert ring.beside(0) == (3, 1)
    assert ring.beside(3) == (2, 0)
    assert ring.beside(4) == (5, 5)


def test_directions_between_views():
    ring = views()
    assert ring.azimuth(1, -0.5) == pytest.approx(math.radians(20))
    assert ring.azimuth(1, 0.5) == pytest.approx(math.radians(60))
    # There is nothing between views that are far apart.
    assert ring.azimuth(2, 0.5) == pytest.approx(math.radians(80))


SPEC = BankSpec(height=96, width=64, azimuths=4, phases=4, builds='average,coat')


@pytest.fixture(scope='module')
def drawn():
    return build_bank(SPEC)


def foreign(azimuths, height=20):
    templates = np.zeros((len(azimuths), 4, height, 15), np.uint8)
    templates[:, :, 4:16, 5:11] = 255
    names = ('mine',) * len(azimuths)
    return TemplateBank(templates, np.radians(azimuths).astype(np.float32), names, 0.9)


def test_places_go_round(drawn):
    views = FineViews(drawn)
    assert views.templates is drawn.finer.templates
    assert views.reach == 3
    for azimuth in np.linspace(-3.1, 3.1, 9):
        place = views.place('coat', azimuth)
        around = views.around('coat', place)
        away = abs(np.exp(1j * views.azimuths[around[3]]) - np.exp(1j * azimuth))
        assert away <= math.pi / 64 + 1e-6
        assert len(set(around)) == 7
        assert around[1:] == views.around('coat', place + 1)[:-1]
    last, first = views.place('average', math.pi - 0.1), views.place('average', -math.pi + 0.1)
    assert views.steps('average', last, first) == 2
    assert views.steps('average', first, last) == -2
    likely = views.likely()
    assert likely.argmax() == 3
    assert likely == pytest.approx(likely[::-1])


@pytest.mark.parametrize(
    ('azimuths', 'reach'),
    [([0], 0), ([0, 180], 0), (list(range(0, 360, 45)), 1), ([0, 30, 60], 0)],
)
def test_views_of_other_banks_are_used_where_they_are_close(azimuths, reach):
    drawn = foreign(azimuths)
    views = FineViews(drawn)
    assert views.reach == reach
    assert views.templates.shape == (len(azimuths), 4, 48, 36)
    assert views.templates.mean() == pytest.approx(drawn.templates.mean(), rel=0.02)
    assert len(views.around('mine', 0)) == 2 * reach + 1
