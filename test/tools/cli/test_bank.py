# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import json
import re

import cv2
import numpy as np
import pytest

from gait_segmentation.gait_model import TemplateBank
from gait_tools.cli import bank as command
from gait_tools.gait_model import render_silhouette

GRID = ['--height', '48', '--width', '32', '--phases', '4']
SMALL = [*GRID, '--azimuths', '2']


def draw_walk(folder):
    for n in range(64):
        alpha = render_silhouette(n / 28, 0.0, 60.0)
        cv2.imwrite(str(folder / f'{n:03}.png'), np.where(alpha >= 128, 255, 0).astype(np.uint8))


@pytest.fixture
def built(tmp_path):
    path = tmp_path / 'bank.npz'
    assert command.main(['build', str(path), *SMALL, '--quiet']) == 0
    return path


def test_build_and_info(built, capsys):
    assert command.main(['info', str(built), '--json']) == 0
    about = json.loads(capsys.readouterr().out)
    assert about['sequences'] == 2
    assert about['azimuths_deg'] == [0.0, 180.0]
    assert about['builds'] == ['average']
    assert about['provenance']['source'] == 'gait model'
    assert command.main(['info', str(built)]) == 0
    assert 'azimuths_deg         0.0, 180.0' in capsys.readouterr().out


def test_show(built, tmp_path, capsys):
    picture = tmp_path / 'sheet.png'
    assert command.main(['show', str(built), '-o', str(picture), '--columns', '2']) == 0
    image = cv2.imread(str(picture), cv2.IMREAD_GRAYSCALE)
    assert f'{image.shape[1]} x {image.shape[0]}' in capsys.readouterr().out
    assert image.max() == 255


def test_build_from_silhouettes(tmp_path):
    folder = tmp_path / 'walk'
    folder.mkdir()
    draw_walk(folder)
    path = tmp_path / 'own.npz'
    arguments = ['build', str(path), *GRID, '--quiet', '--from', str(folder)]
    assert command.main([*arguments, '--azimuth', '0', '--mirror']) == 0
    bank = TemplateBank.load(path)
    assert bank.builds == ('walk', 'walk')
    assert bank.azimuth == pytest.approx([0, np.pi])
    arguments += [str(folder), '--azimuth', '0', '--average']
    assert command.main(arguments) == 0
    assert TemplateBank.load(path).builds == ('average',)


@pytest.mark.parametrize(
    ('arguments', 'message'),
    [
        (['info', 'none.npz'], 'cannot read the bank none.npz'),
        (['show', '--sequences', '0', '16'], r'sequences must be from 0 to 15, got \[16\]'),
        (['show', '--columns', '0'], 'columns must be at least 1, got 0'),
        (['build', 'no/where/x.npz'], 'no/where is not a folder'),
        (['show', '-o', 'sheet.xyz'], r'sheet\.xyz cannot be written: its name must end in'),
        (['build', 'x.npz', '--azimuth', '3'], '--mirror and --average belong to --from'),
        (['build', 'x.npz', '--from', 'f'], '--from needs --azimuth'),
    ],
)
def test_errors_are_one_line_and_two(tmp_path, monkeypatch, capsys, arguments, message):
    monkeypatch.chdir(tmp_path)
    assert command.main(arguments) == 2
    lines = [line for line in capsys.readouterr().err.splitlines() if 'error' in line]
    assert len(lines) == 1
    assert lines[0].startswith('gait_bank: error: ')
    assert re.search(message, lines[0])


def test_what_is_read_is_not_written_to(built, tmp_path, capsys):
    before = built.read_bytes()
    (tmp_path / 'link.png').symlink_to(built)
    assert command.main(['show', str(built), '-o', str(tmp_path / 'link.png')]) == 2
    assert f'is the input {built}, which would be changed' in capsys.readouterr().err
    assert built.read_bytes() == before
    (tmp_path / 'walk').mkdir()
    given = ['--from', str(tmp_path / 'walk'), '--azimuth', '0']
    assert command.main(['build', str(tmp_path / 'walk/0.png'), *given]) == 2
    assert 'lies in the input' in capsys.readouterr().err
    assert command.main(['vocabulary', str(tmp_path / 'walk/0.json'), *given[:2]]) == 2
    assert 'lies in the input' in capsys.readouterr().err


def test_what_others_have_made_is_not_replaced(built, tmp_path, capsys):
    other = tmp_path / 'photo.png'
    image = np.full((20, 30), 7, np.uint8)
    other.write_bytes(cv2.imencode('.png', image)[1].tobytes())
    before = other.read_bytes()
    for given in (
        ['show', str(built), '-o', str(other)],
        ['build', str(other)],
        ['vocabulary', str(other)],
        ['vocabulary', str(tmp_path / 'new.json'), '--picture', str(other)],
    ):
        assert command.main(given) == 2
        assert f'{other} was not made by gait_bank' in capsys.readouterr().err
    assert other.read_bytes() == before


def test_rows_are_sequences_and_columns_phases():
    templates = np.arange(1, 13, dtype=np.uint8).reshape(3, 4, 1, 1).repeat(40, 2).repeat(32, 3)
    bank = TemplateBank(templates, np.zeros(3, np.float32), ('a', 'b', 'c'), 0.9)
    sheet = command.contact_sheet(bank, columns=2, sequences=[2, 0])
    tiles = sheet[-80:, -64:]
    assert (tiles[:40, :32] == 9).all()
    assert (tiles[:40, 32:] == 11).all()
    assert (tiles[40:, :32] == 1).all()
    assert sheet[:, :-64].any()  # labels
    everything = command.contact_sheet(bank, columns=100)
    assert everything.shape == command.contact_sheet(bank, columns=4).shape
