# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import cv2
import numpy as np
import pytest

from gait_segmentation.errors import SequenceError
from gait_tools.evaluation.output import SequenceOutput, write_image
from gait_tools.evaluation.runner import run
from gait_tools.evaluation.sequence import Sequence

from .fakes import FakePipeline, write_sequence


def test_masks_and_a_sheet_are_written(tmp_path):
    sequence = Sequence.load(write_sequence(tmp_path / 'walk', frames=5))
    output = SequenceOutput(tmp_path / 'out', sequence)
    made = run(FakePipeline(), sequence, sequence.numbers, sequence.starts, clock=lambda: 0.0)
    outcomes = list(made)
    for outcome in outcomes:
        assert outcome.number in output.shown
        output.add(outcome)
    output.close()
    names = sorted(path.name for path in (tmp_path / 'out' / 'masks').iterdir())
    assert names == [f'{number:04d}.png' for number in range(5)]
    mask = cv2.imread(str(tmp_path / 'out' / 'masks' / '0003.png'), cv2.IMREAD_UNCHANGED)
    np.testing.assert_array_equal(mask, outcomes[3].mask)
    assert cv2.imread(str(tmp_path / 'out' / 'contact_sheet.png')).shape == (264, 1024, 3)


def test_a_file_in_the_way_is_an_error(tmp_path):
    (tmp_path / 'out').write_text('')
    with pytest.raises(SequenceError, match='cannot be written'):
        write_image(tmp_path / 'out' / 'a.png', np.zeros((2, 2), np.uint8))
