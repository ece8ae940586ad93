# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from pathlib import Path

import cv2
import numpy as np
import pytest

from gait_segmentation.cli.demo_output import FilmImages
from gait_segmentation.errors import SequenceError
from gait_segmentation.inputs import open_input


def test_images_of_a_film_come_by_number_in_any_order(tmp_path: Path) -> None:
    for number in range(6):
        assert cv2.imwrite(str(tmp_path / f'{number}.png'), np.full((8, 8, 3), number, np.uint8))
    images = FilmImages(open_input(tmp_path, start=1))
    assert [int(images[number][0, 0, 0]) for number in (1, 1, 2, 5, 3, 3, 1)] == [
        1, 1, 2, 5, 3, 3, 1,
    ]  # fmt: skip
    (tmp_path / '4.png').write_bytes(b'nothing')
    with pytest.raises(SequenceError, match=r'4\.png'):
        images[4]
