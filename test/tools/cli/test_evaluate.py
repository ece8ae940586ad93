# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import json
import sys

import cv2
import numpy as np
import pytest

from gait_segmentation.cli import replay
from gait_tools.cli.evaluate import main
from test.networks import red_network
from test.walkers import body

from ..evaluation.fakes import FakePipeline, write_mot, write_sequence


@pytest.fixture
def threads():
    """Have as many threads afterwards as before."""
    threads = cv2.getNumThreads()
    yield
    cv2.setNumThreads(threads)


@pytest.fixture
def pipeline(threads, monkeypatch):
    """Put a quick pipeline in place of the real one."""
    monkeypatch.setattr('gait_segmentation.pipeline.Pipeline', FakePipeline)
    monkeypatch.setattr('gait_segmentation.kernels.compile_kernels', lambda: None)


@pytest.fixture
def made(pipeline, monkeypatch):
    """Return the pipelines that are made; each knows its bank."""
    pipelines = []

    def make(config, bank, clock):
        pipelines.append(FakePipeline(config))
        pipelines[-1].bank = bank
        return pipelines[-1]

    monkeypatch.setattr('gait_segmentation.pipeline.Pipeline', make)
    return pipelines


@pytest.fixture
def folder(tmp_path):
    return write_sequence(tmp_path / 'walk', frames=6)


def test_scores_are_printed_and_written(pipeline, folder, tmp_path, capsys):
    out, scores = tmp_path / 'out', tmp_path / 'scores.json'
    scores.touch()
    # What it has made itself is replaced, by the same bytes.
    for _ in range(2):
        assert main([str(folder), '--json', str(scores), '--out', str(out), '--warm']) == 0
        lines = capsys.readouterr().out.splitlines()
        made = {path: path.read_bytes() for path in out.rglob('*.png')}
    assert main([str(folder), '--out', str(out)]) == 0
    assert made == {path: path.read_bytes() for path in out.rglob('*.png')}
    assert len(made) == 7
    assert lines[1].split()[:3] == ['walk', '6', '1.0000']
    assert lines[4].startswith('tracking')
    assert lines[5].split()[:3] == ['walk', '1', '1.0000']
    report = json.loads(scores.read_text())
    numbers = report['sequences']['walk']
    assert set(numbers) == {
        'frames', 'J', 'F', 'collapsed', 'error_rate', 'error_rate_image', 'box_iou',
        'lost_frames', 'tracked', 'placed', 'matched', 'ms_per_frame', 'fps', 'tracking',
    }  # fmt: skip
    assert set(numbers['ms_per_frame']) == {'tracking', 'matching', 'segmentation', 'total'}
    assert report['mean']['J'] == 1
    assert report['warm']['J0'] == 1
    assert (out / 'walk' / 'contact_sheet.png').is_file()
    assert cv2.imread(str(out / 'walk' / 'masks' / '0000.png'), -1).max() == 255


def test_numbers_alone_are_on_standard_output_if_asked_for(pipeline, folder, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, 'motmetrics', None)
    assert main([str(folder), '--json', '-']) == 0
    said = capsys.readouterr()
    assert json.loads(said.out)['mean']['J'] == 1
    assert said.err.splitlines()[1].split()[:3] == ['walk', '6', '1.0000']
    # Columns that cannot be filled are left out.
    assert 'MOTA  ' not in said.err
    assert 'MOTA and IDF1 need the Python package motmetrics' in said.err


def test_a_table_of_what_mechanisms_are_worth_is_written(pipeline, folder, tmp_path, capsys):
    page, out = tmp_path / 'page.md', tmp_path / 'out'
    command = [str(folder), '--ablate', 'mechanisms', '--write', str(page)]
    assert main(command) == main([*command, '--out', str(out), '--warm']) == 2
    assert '--ablate needs --out' in capsys.readouterr().err
    page.write_text('# A\n<!-- mechanisms -->\nold\n')
    assert main([*command, '--out', str(out)]) == 2
    assert 'must have lines <!-- mechanisms --> and' in capsys.readouterr().err
    page.write_text('# A\n<!-- mechanisms -->\nold\n<!-- end -->\nz\n')
    assert main([*command, '--out', str(out)]) == 0
    table = capsys.readouterr().out
    assert '| texture |' in table
    assert page.read_text() == f'# A\n<!-- mechanisms -->\n{table}<!-- end -->\nz\n'


def test_boxes_are_given_or_not_and_what_is_set_stays(made, folder):
    alone = ['--set', 'detector.network=none']
    two = ['--init', 'auto', '--set', 'people.max_people=2']
    for options in ([], alone, ['--init', 'auto'], two):
        assert main([str(folder), *options]) == 0
    assert [each.box is None for each in made] == [False, False, True, True]
    assert [each.config.detector.network == 'none' for each in made] == [
        False,
        True,
        False,
        False,
    ]
    assert [each.config.people.max_people for each in made] == [1, 1, 1, 2]


def test_a_preset_is_overridden_by_other_options(made, folder, tmp_path, monkeypatch, capsys):
    file = tmp_path / 'preset.yaml'
    file.write_text(
        '/**:\n  ros__parameters:\n    tracking: {use_texture: false}\n'
        '    segmentation: {prior: paper}\n'
    )
    monkeypatch.setattr('gait_tools.cli.evaluate.preset_file', {'paper': file}.get)
    command = [str(folder), '--preset', 'paper']
    assert main(command) == 0
    assert main([*command, '--prior', 'none', '--set', 'tracking.use_texture=true']) == 0
    given = [(each.config.segmentation.prior, each.config.tracking.use_texture) for each in made]
    assert given == [('paper', False), ('none', True)]
    with pytest.raises(SystemExit, match='2'):
        main([str(folder), '--preset', 'papre'])
    said = capsys.readouterr().err
    assert 'papre' in said
    assert 'paper' in said.split('papre')[1]


def test_tracks_that_were_written_are_scored_as_those_of_a_run(tmp_path, threads, capsys):
    """Two people in red on a lawn, for a network that sees red, called each other's names."""
    pytest.importorskip('motmetrics')
    lawn = np.random.default_rng(3).integers(60, 120, (90, 160, 3), np.uint8)
    lawn[..., 2] = 0
    images, lines = [], []
    for number in range(1, 9):
        images.append(lawn.copy())
        for person, x in ((1, 15 + 2 * number), (2, 115 - 2 * number)):
            images[-1][15:75, x : x + 30, 2] = body()
            name = person if number < 6 else 3 - person
            lines.append(f'{number},{name},{x},15,30,60,1,1,1')
    folder = write_mot(tmp_path / 'pair', lines, '[Sequence]\nframeRate=25\n', images)
    network = f'detector.network={red_network(tmp_path, lawn.shape)}'
    ran, scored, tracks = (tmp_path / name for name in ('ran.json', 'scored.json', 'tracks.txt'))
    assert main([str(folder), '--set', network, '--json', str(ran)]) == 0
    said = capsys.readouterr().out.splitlines()
    slots = ['--set', 'people.max_people=16', '--rate', '25', '--out', str(tmp_path / 'out')]
    words = [str(folder / 'img1'), '--set', network, *slots, '--tracks', str(tracks)]
    assert replay.main(words) == 0
    capsys.readouterr()
    assert main([str(folder), '--tracks', str(tracks), '--json', str(scored)]) == 0
    assert capsys.readouterr().out.splitlines() == said
    assert [line.split()[0] for line in said] == ['boxes', 'pair', 'overall']
    report = json.loads(ran.read_text())
    assert report == json.loads(scored.read_text())
    # Five of eight frames each; exchanged are they in the sixth.
    assert report['overall'] == report['sequences']['pair'] == {
        'people': 2, 'mota': 14 / 16, 'idf1': 10 / 16, 'recall': 1, 'precision': 1,
        'id_switches': 2,
    }  # fmt: skip


def test_slots_are_sixteen_unless_set_and_motmetrics_is_asked_for_first(
    made, tmp_path, monkeypatch, capsys
):
    pytest.importorskip('motmetrics')
    black = np.zeros((40, 48, 3), np.uint8)
    folder = write_mot(tmp_path / 'walk', ['2,1,10,5,10,20,1,1,1'], '', [black] * 2)
    assert main([str(folder)]) == 0
    assert main([str(folder), '--set', 'max_people=2', '--prior', 'none']) == 0
    assert [each.config.people.max_people for each in made] == [16, 2]
    assert [each.config.segmentation.prior for each in made] == ['default', 'none']
    assert [each.box for each in made] == [None, None]
    capsys.readouterr()
    monkeypatch.setitem(sys.modules, 'motmetrics', None)
    assert main([str(folder)]) == 2
    assert 'MOTA and IDF1 need the Python package motmetrics' in capsys.readouterr().err
    assert len(made) == 2
