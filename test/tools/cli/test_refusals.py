# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tools refuse: in one line, with code 2, and before anything is changed."""

from importlib import import_module
from pathlib import Path

import cv2
import numpy as np
import pytest

from test.walkers import small_bank

from ..evaluation.fakes import write_mot, write_sequence

CHANGED = 'which would be changed'
OTHERS = 'photo.png was not made by'
REFUSED = [
    ('bank', 'info none.npz', 'cannot read the bank none.npz'),
    ('bank', 'show --columns 0', 'columns must be at least 1, got 0'),
    ('bank', 'build no/where/x.npz', 'no/where is not a folder'),
    ('bank', 'show -o sheet.xyz', 'sheet.xyz cannot be written: its name must end in'),
    ('bank', 'build x.npz --azimuth 3', '--mirror and --average belong to --from'),
    ('bank', 'build x.npz --from f', '--from needs --azimuth'),
    ('bank', 'show bank.npz -o link.png', f'is the input bank.npz, {CHANGED}'),
    ('bank', 'build walk/0.png --from walk --azimuth 0', 'lies in the input'),
    ('bank', 'vocabulary walk/0.json --from walk', 'lies in the input'),
    ('bank', 'vocabulary missing/words.json', 'is not a folder'),
    ('bank', 'vocabulary words.json --picture missing/words.png', 'is not a folder'),
    ('bank', 'vocabulary words.json --words 0', 'words must be'),
    ('bank', 'vocabulary words.json --from missing', 'is not a folder of silhouettes'),
    ('bank', 'show bank.npz -o photo.png', OTHERS),
    ('bank', 'build photo.png', OTHERS),
    ('bank', 'vocabulary photo.png', OTHERS),
    ('bank', 'vocabulary new.json --picture photo.png', OTHERS),
    ('evaluate', 'walk --set matching.lag=-1', 'lag must be an integer from 0'),
    ('evaluate', 'walk --bank none.npz', 'cannot read the bank none.npz'),
    ('evaluate', 'walk --heat-map heat', 'heat is missing, no heat maps'),
    ('evaluate', 'walk --json /nowhere/at/all.json', 'cannot be written'),
    ('evaluate', 'walk --out /dev/null/at/all', '--out /dev/null/at/all: nothing can be written'),
    ('evaluate', 'walk --out link', f'lies in the input walk, {CHANGED}'),
    ('evaluate', 'hard.yaml --json hard.yaml', f'is the input hard.yaml, {CHANGED}'),
    ('evaluate', 'walk --bank bank.npz --json bank.npz', f'is the input bank.npz, {CHANGED}'),
    ('evaluate', 'walk --json letter', '--json letter was not made by gait_evaluate'),
    ('evaluate', 'walk --out mine', 'mine/walk/masks/holiday.png was not made by gait_evaluate'),
    ('evaluate', 'mot --warm', '--warm is for sequences with masks'),
    ('evaluate', 'mot --heat-map heat', '--heat-map is for sequences with masks'),
    ('evaluate', 'mot --ablate mechanisms', '--ablate is for sequences with masks'),
    ('evaluate', 'mot --out out', '--out is for sequences with masks'),
    ('evaluate', 'mot walk', 'walk has no gt/gt.txt, which others here have'),
    ('evaluate', 'walk --tracks letter', 'walk has no gt/gt.txt, which --tracks needs'),
    ('evaluate', 'mot --tracks letter', 'letter, line 1 must be numbers frame,id,'),
    ('evaluate', 'mot --tracks missing', 'missing: No such file'),
    ('evaluate', 'mot --tracks letter --set matching.lag=0', '--set is for the pipeline'),
    ('evaluate', 'mot --tracks letter --json letter', f'is the input letter, {CHANGED}'),
    ('evaluate', 'mot', 'img1 holds no images'),
    ('evaluate', 'mot link/mot', 'has the same name as'),
    ('figures', 'walk/frames', '--box is needed'),
    ('figures', 'walk --out /dev/null/at/all', '--out /dev/null/at/all: nothing can be written'),
    ('figures', 'walk --out walk', CHANGED),
    ('figures', 'walk --out mine', 'table.png was not made by gait_figures'),
    ('demo', '--clip no_such.mp4 --box 1 1 9 9', 'does not exist'),
    ('demo', '--box 1 1 9 9', 'give --clip'),
    ('demo', '--clip walk/frames --box 99 1 9 9', 'not lie outside of the image'),
    ('demo', '--clip walk/frames --rate -1', 'rate must be 0, or from 0.01 to 1000 Hz'),
    (
        'demo',
        '--detector me',
        "must be people, boxes, none or a file FILE.onnx, got 'me'",
    ),
    ('demo', '--clip walk/frames --out letter', 'nothing can be written'),
    ('demo', '--clip walk/frames --box 1 1 9 9 --out walk/frames', 'lies in the input'),
    ('demo', '--clip walk/frames --box 1 1 9 9 --out mine', 'was not made by gait_demo'),
]


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Be where there are inputs, ways to them, and what somebody else has made."""
    monkeypatch.chdir(tmp_path)
    write_sequence(Path('walk'), frames=2)
    write_mot(Path('mot'), ['1,1,10,5,10,20,1,1,1'])
    small_bank().save(Path('bank.npz'))
    Path('link.png').symlink_to('bank.npz')
    Path('link').symlink_to('.')
    Path('hard.yaml').hardlink_to('walk/sequence.yaml')
    Path('letter').write_text('{"dear": "you"}')
    for name in ('photo.png', 'mine/table.png', 'mine/masks/0003.png'):
        Path(name).parent.mkdir(parents=True, exist_ok=True)
        cv2.imwrite(name, np.full((20, 30, 3), 7, np.uint8))
    Path('mine/walk/masks').mkdir(parents=True)
    Path('mine/walk/masks/holiday.png').write_bytes(Path('photo.png').read_bytes())
    return tmp_path


def contents(place: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in place.rglob('*') if path.is_file()}


@pytest.mark.parametrize(('command', 'given', 'reason'), REFUSED)
def test_what_cannot_be_done_is_said_in_one_line(
    command: str, given: str, reason: str, place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    if command == 'demo':
        pytest.importorskip('rclpy', reason='needs ROS 2: rclpy cannot be imported')
    before = contents(place)
    assert import_module(f'gait_tools.cli.{command}').main(given.split()) == 2
    (said,) = [line for line in capsys.readouterr().err.splitlines() if 'error: ' in line]
    assert said.startswith(f'gait_{command}: error: ')
    assert reason in said
    assert contents(place) == before
