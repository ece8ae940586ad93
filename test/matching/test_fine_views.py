# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import math

import numpy as np
import pytest

from gait_segmentation.gait_model import TemplateBank
from gait_segmentation.matching.fine_views import FineViews
from gait_tools.gait_model import BankSpec, build_bank

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
        away = abs(np.exp(1j * views.azimuth('coat', place)) - np.exp(1j * azimuth))
        assert away <= math.pi / 64 + 1e-6
        around = views.around('coat', place)
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
