# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a mechanism is worth is told over places, and nothing is run twice."""

import time

import pytest

from gait_segmentation.pipeline import PipelineConfig
from gait_tools.evaluation.ablation import ablate
from gait_tools.evaluation.session import Session, load_sequences

from .fakes import FakePipeline, write_sequence


@pytest.fixture
def folders(tmp_path):
    return [written(tmp_path / name, 'moving', frames=2) for name in 'ab']


def written(folder, camera, **options):
    write_sequence(folder, **options)
    with (folder / 'sequence.yaml').open('a') as file:
        file.write(f'kind: walk\ncamera: {camera}\n')
    return folder


def rows(folders, out, make_pipeline=FakePipeline, settings=(), **options):
    out.mkdir(exist_ok=True)
    session = Session(load_sequences(folders), make_pipeline, time.perf_counter)
    table = ''.join(ablate(session, PipelineConfig(), settings, out, **options))
    cells = [[cell.strip() for cell in line.split('|')[1:-1]] for line in table.splitlines()[2:]]
    return {(each[0], each[1]): each[2:] for each in cells}


def test_each_mechanism_is_left_out_once_and_what_is_done_is_not_run_again(folders, tmp_path):
    found = rows(folders, tmp_path / 'out', boxes=2, spoilt=['night'])
    assert found['nothing', 'plain'] == ['1.000', '1.000', '1.000', '', '']
    assert found['tilt', 'plain'] == ['0', '0', '0', '', '']
    assert ('grey fade', 'night') in found
    assert ('light', 'ramp') not in found
    j, *_, worse, better = found['texture', 'plain']
    assert (float(j.split()[0]) < -0.4, better) == (True, '')
    assert worse == 'J: all; F: all; box: all'
    assert rows(folders, tmp_path / 'out', None, boxes=2, spoilt=['night']) == found
    with pytest.raises(TypeError):
        rows(folders, tmp_path / 'out', None, ['other=1'], boxes=2)


def test_processes_find_the_same_and_more_films_are_added(folders, tmp_path):
    rows(folders[:1], tmp_path / 'out')
    assert rows(folders, tmp_path / 'out', jobs=2) == rows(folders, tmp_path / 'other')


def test_who_leaves_is_missed_where_a_camera_stands(folders, tmp_path):
    stands = written(tmp_path / 'c', 'static', frames=30, size=(90, 40))
    found = rows([*folders, stands], tmp_path / 'out', spoilt=['left'])
    assert found['nothing', 'left'][0] == '1.000'
    j, *_, worse, better = found['stillness', 'left']
    assert (j.split()[0], better) == ('-1.0000', '')
    assert worse.startswith('J: all; ')
    assert found['stillness', 'plain'][0] == '0'


def test_what_is_worse_for_a_group_alone_is_told(folders, tmp_path):
    # The lower half of these images shows nothing that could be lost.
    fine = [written(tmp_path / name, 'static', frames=2, size=(48, 80)) for name in 'cd']
    *_, worse, better = rows([*folders, *fine], tmp_path / 'out')['texture', 'plain']
    only = 'moving, walkers moving'
    assert (worse, better) == (f'J: {only}; F: {only}; box: {only}', '')
