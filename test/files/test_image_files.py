# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import os
import random
from pathlib import Path

import pytest

from gait_segmentation.errors import SequenceError
from gait_segmentation.files.image_files import by_number, read_grey, read_image, read_unchanged
from test.files.test_encoded_images import HUGE


@pytest.mark.parametrize(
    'names',
    [
        ['frame1.png', 'frame2.png', 'frame10.png', 'frame100.png'],
        ['0001.png', '0002.png', '0010.png'],
        ['1_9.png', '2_1.png', '2_10.png', '10_1.png'],
        ['7.png', '10.png', 'a1.png', 'a9.png', 'b0.png'],
        ['01.png', '1.png', '2.png'],
    ],
)
def test_names_are_in_the_order_of_their_numbers(names):
    paths = [Path('somewhere9') / name for name in names]
    random.Random(0).shuffle(paths)
    assert [path.name for path in sorted(paths, key=by_number)] == names


@pytest.mark.parametrize('read', [read_image, read_grey, read_unchanged])
def test_an_image_that_would_take_minutes_is_refused(read, tmp_path: Path) -> None:
    path = tmp_path / '0.png'
    path.write_bytes(HUGE['png of zeros'])
    with pytest.raises(SequenceError, match=r'0\.png: image must have at most .* got more'):
        read(path)


@pytest.mark.parametrize('read', [read_image, read_grey, read_unchanged])
def test_a_pipe_is_no_image(read, tmp_path: Path) -> None:
    path = tmp_path / '0.png'
    os.mkfifo(path)
    with pytest.raises(SequenceError, match=r'0\.png cannot be read: it is a pipe and no file'):
        read(path)
