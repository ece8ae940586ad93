# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import cv2
import pytest

from gait_tools.evaluation.ablation import (
    compare,
    comparison_table,
    plot_priors,
)
from gait_tools.evaluation.session import Session, load_sequences

from .fakes import FakePipeline, FakePipelineConfig, write_sequence


@pytest.fixture(params=[False, True])
def session(request, tmp_path):
    sequences = load_sequences([write_sequence(tmp_path / 'walk', frames=6)])
    return Session(sequences, FakePipeline, lambda: 0.0, restarts=request.param)


def test_every_prior_is_evaluated(session):
    config = FakePipelineConfig()
    base = session.evaluate(config)
    reports = compare(session, config, base, 'priors')
    assert list(reports) == ['none', 'paper', 'default']
    assert reports['default'] == base
    assert reports['none']['mean']['error_rate_image'] > 0
    lines = comparison_table('priors', base, reports).splitlines()
    assert lines[0].split()[:4] == ['priors', 'error', '%', 'J']
    assert lines[3].split()[:5] == ['default', '0.00', '1.0000', '1.0000', '+0.0000']


def test_each_switch_is_turned_off_once(session):
    config = FakePipelineConfig()
    base = session.evaluate(config)
    reports = compare(session, config, base, 'ingredients')
    assert list(reports) == ['tracking.use_colour']
    lines = comparison_table('ingredients', base, reports).splitlines()
    assert len(lines) == 2
    words = lines[1].split()
    assert words[0] == 'tracking.use_colour'
    assert float(words[4]) < -0.4
    assert words[-2] == 'walk'
    assert ('restart' in lines[0]) == session.restarts


REPORTS = {
    prior: {'sequences': {'walk': {'error_rate': error}}, 'mean': {'error_rate': error}}
    for prior, error in (('none', 4.0), ('default', 2.0))
}


def test_a_picture_is_drawn(tmp_path):
    plot_priors(tmp_path / 'new' / 'priors.png', REPORTS)
    assert cv2.imread(str(tmp_path / 'new' / 'priors.png')).shape[0] > 200
