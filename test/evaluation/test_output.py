# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from gait_segmentation.errors import SequenceError
from gait_segmentation.evaluation.metrics import score_frame
from gait_segmentation.evaluation.output import SequenceOutput, tile, write_image
from gait_segmentation.evaluation.runner import Outcome, run
from gait_segmentation.evaluation.sequence import Sequence
from gait_segmentation.geometry import Box

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


def test_a_long_sequence_shows_frames_spread_evenly(tmp_path):
    shown = sorted(SequenceOutput(tmp_path, SimpleNamespace(numbers=range(100, 200))).shown)
    assert len(shown) == 28
    assert (shown[0], shown[-1]) == (100, 199)
    assert max(np.diff(shown)) <= 4


def test_a_tile_shows_found_and_true_outline():
    image = np.full((60, 60, 3), 90, np.uint8)
    truth = np.zeros((60, 60), np.uint8)
    truth[10:50, 20:40] = 255
    mask = np.roll(truth, 8, axis=1)
    score = score_frame(mask, None, truth)
    outcome = Outcome(7, mask, None, 0.0, {}, 0.0, score)
    picture = tile(image, outcome, truth, Box(0, 0, 60, 60))
    assert picture.shape == (256, 200, 3)
    found = (picture[..., 1] > 220) & (picture[..., 2] < 100)
    true = (picture[..., 1] < 120) & (picture[..., 2] > 220)
    assert found.sum() > 300
    assert true.sum() > 100


def test_a_file_in_the_way_is_an_error(tmp_path):
    (tmp_path / 'out').write_text('')
    with pytest.raises(SequenceError, match='cannot be written'):
        write_image(tmp_path / 'out' / 'a.png', np.zeros((2, 2), np.uint8))
