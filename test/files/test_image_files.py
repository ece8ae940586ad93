# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import os
import random
from pathlib import Path

import pytest

from gait_segmentation.errors import SequenceError
from gait_segmentation.files.image_files import by_number, read_image
from test.files.test_encoded_images import HUGE


@pytest.mark.parametrize(
    'names',
    [
        ['frame1.png', 'frame2.png', 'frame10.png', 'frame100.png'],
        ['1_9.png', '2_1.png', '2_10.png', '10_1.png'],
        ['7.png', '10.png', 'a1.png', 'a9.png', 'b0.png'],
        ['01.png', '1.png', '2.png'],
        ['1700000000.123.png', '1700000000.5.png', '1700000000.98.png', '1700000001.png'],
        ['0.png', '1e-05.png', '0.033333.png', '0.1.png', '10.0.png'],
        ['-1.5.png', '-0.25.png', '0.5.png'],
        ['1.2.3.png', '1.2.20.png', '1.10.1.png'],
        ['a 0.05 s.png', 'a 0.3 s.png', 'a 0.25e+1 s.png'],
    ],
)
def test_names_are_in_the_order_of_their_numbers(names):
    paths = [Path('somewhere9') / name for name in names]
    random.Random(0).shuffle(paths)
    assert [path.name for path in sorted(paths, key=by_number)] == names


def test_a_pipe_and_an_image_that_would_take_minutes_are_refused(tmp_path: Path) -> None:
    path = tmp_path / '0.png'
    path.write_bytes(HUGE['png of zeros'])
    with pytest.raises(SequenceError, match=r'0\.png: image must have at most .* got more'):
        read_image(path)
    path.unlink()
    os.mkfifo(path)
    with pytest.raises(SequenceError, match=r'0\.png cannot be read: it is a pipe and no file'):
        read_image(path)
