# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A recording for gait_replay."""

from pathlib import Path

import pytest

from test.inputs.bags import image_fields, stamp, write_bag2
from test.walkers import box_of, clip, small_bank

FRAMES = 10
BROKEN = 4


@pytest.fixture(scope='module')
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a bank and a bag, one of whose images cannot be read."""
    path = tmp_path_factory.mktemp('replay')
    small_bank().save(path / 'small.npz')
    messages = [
        image_fields(frame.image, stamp(index)) for index, frame in enumerate(clip()[:FRAMES])
    ]
    messages[BROKEN].encoding = '64FC9'
    write_bag2(path / 'walk', {'/camera/image_raw': messages})
    return path


@pytest.fixture
def given(folder: Path, tmp_path: Path) -> list[str]:
    """Return the command line."""
    box = box_of(clip()[0])
    numbers = [str(value) for value in (box.x, box.y, box.width, box.height)]
    return [
        str(folder / 'walk'), '--bank', str(folder / 'small.npz'), '--box', *numbers,
        '--out', str(tmp_path / 'out'),
    ]  # fmt: skip
