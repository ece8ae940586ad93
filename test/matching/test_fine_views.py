# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import math

import numpy as np
import pytest

from gait_segmentation.gait_model import BankSpec, TemplateBank, build_bank
from gait_segmentation.gait_model.builder import fine_grid, finer_bank
from gait_segmentation.matching.fine_views import FineViews

SPEC = BankSpec(height=96, width=64, azimuths=4, phases=4, builds='average,coat')


@pytest.fixture(scope='module', autouse=True)
def cache(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv('XDG_CACHE_HOME', str(tmp_path_factory.mktemp('cache')))
        yield


@pytest.fixture(scope='module')
def drawn():
    return build_bank(SPEC)


def foreign(azimuths, height=20):
    templates = np.zeros((len(azimuths), 4, height, 15), np.uint8)
    templates[:, :, 4:16, 5:11] = 255
    names = ('mine',) * len(azimuths)
    return TemplateBank(templates, np.radians(azimuths).astype(np.float32), names, 0.9)


def test_the_gait_model_is_drawn_in_more_directions_and_coarser(drawn):
    finer = finer_bank(drawn)
    assert finer.grid == fine_grid(drawn) == (48, 32)
    assert (finer.phases, finer.fill) == (drawn.phases, drawn.fill)
    for sequence in range(drawn.sequences):
        away = np.abs(np.exp(1j * finer.azimuth) - np.exp(1j * drawn.azimuth[sequence]))
        same = [
            k for k, name in enumerate(finer.builds)
            if name == drawn.builds[sequence] and away[k] < 1e-5
        ]  # fmt: skip
        assert len(same) == 1
        full = drawn.templates[sequence].astype(float).reshape(4, 48, 2, 32, 2).mean((2, 4))
        assert np.abs(full - finer.templates[same[0]]).mean() < 2


def test_a_bank_of_silhouettes_or_of_another_model_has_no_finer_views(drawn):
    assert finer_bank(foreign([0, 180])) is None
    old = TemplateBank(
        drawn.templates, drawn.azimuth, drawn.builds, drawn.fill,
        {**drawn.provenance, 'model': 'version 1, 0'},
    )  # fmt: skip
    assert finer_bank(old) is None


def test_places_go_round(drawn):
    views = FineViews(drawn)
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
