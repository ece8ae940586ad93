# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import re

import cv2
import numpy as np
import pytest

from gait_segmentation.gait_model import TemplateBank
from gait_tools.cli import bank as command
from gait_tools.gait_model import render_silhouette

GRID = ['--height', '48', '--width', '32', '--phases', '4']


def test_a_bank_is_built_described_and_shown(tmp_path, capsys):
    built, picture = str(tmp_path / 'bank.npz'), str(tmp_path / 'sheet.png')
    assert command.main(['build', built, *GRID, '--azimuths', '2']) == 0
    assert '2 sequences x 4 phases of 48 x 32 pixels' in capsys.readouterr().out
    assert command.main(['info', built]) == 0
    about = dict(re.findall(r'(?m)^(.*?)  +(.*)$', capsys.readouterr().out))
    assert (about['sequences'], about['azimuths_deg']) == ('2', '0.0, 180.0')
    assert about['builds'] == 'average'
    assert command.main(['show', built, '-o', picture, '--columns', '2']) == 0
    image = cv2.imread(picture, cv2.IMREAD_GRAYSCALE)
    assert f'{image.shape[1]} x {image.shape[0]}' in capsys.readouterr().out
    assert image.max() == 255


def test_build_from_silhouettes(tmp_path):
    folder = tmp_path / 'walk'
    folder.mkdir()
    for n in range(64):
        alpha = render_silhouette(n / 28, 0.0, 60.0)
        cv2.imwrite(str(folder / f'{n:03}.png'), np.where(alpha >= 128, 255, 0).astype(np.uint8))
    path = tmp_path / 'own.npz'
    arguments = ['build', str(path), *GRID, '--from', str(folder)]
    assert command.main([*arguments, '--azimuth', '0', '--mirror']) == 0
    bank = TemplateBank.load(path)
    assert bank.builds == ('walk', 'walk')
    assert bank.azimuth == pytest.approx([0, np.pi])
    arguments += [str(folder), '--azimuth', '0', '--average']
    assert command.main(arguments) == 0
    assert TemplateBank.load(path).builds == ('average',)
