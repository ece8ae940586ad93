# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import shutil
from pathlib import Path

import cv2
import pytest

from gait_tools.cli.figures import FILES, main

ROOT = Path(__file__).parents[3]


@pytest.fixture(autouse=True)
def threads():
    before = cv2.getNumThreads()
    yield
    cv2.setNumThreads(before)


def test_the_example_is_drawn(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    out = tmp_path / 'out'
    assert main(['--out', str(out)]) == 0
    assert sorted(path.name for path in out.iterdir()) == sorted(FILES)
    for name in FILES:
        assert cv2.imread(str(out / name)).shape[1] > 800
    said = capsys.readouterr().out
    assert 'phase, best path: 0 % of the steps go back' in said
    row = said.splitlines()[-1].split()
    assert row[1:4] == ['walker', '|', '36']
    # Without the prior, and with it.
    assert float(row[10]) < float(row[5])


def test_of_a_clip_without_truth_there_is_no_table_with_the_preset_either(tmp_path, capsys):
    (tmp_path / 'frames').mkdir()
    for number in range(2):
        shutil.copy(ROOT / f'examples/walker/frames/{number:04d}.jpg', tmp_path / 'frames')
    out = tmp_path / 'out'
    box = ['--box', '26', '41', '43', '110']
    more = ['--preset', 'paper', '--out', str(out)]
    assert main([str(tmp_path / 'frames'), *box, *more]) == 0
    assert sorted(path.name for path in out.iterdir()) == sorted(FILES)
    assert 'no table of errors: the clip has no masks' in capsys.readouterr().out
