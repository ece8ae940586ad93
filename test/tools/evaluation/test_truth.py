# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import cv2
import numpy as np
import pytest

from gait_segmentation.errors import SequenceError
from gait_tools.evaluation.truth import labels_of_truth, read_mask, truth_of


def test_other_people_are_background_of_one():
    labels = np.array([[0, 1, 2, 16, 17, 255]], np.uint8)
    assert truth_of(labels, 2).tolist() == [[0, 0, 255, 0, 170, 170]]
    assert truth_of(labels, 16).tolist() == [[0, 0, 0, 255, 170, 170]]


def test_one_person_is_number_one():
    truth = np.array([[0, 255, 170, 1]], np.uint8)
    labels = labels_of_truth(truth)
    assert labels.tolist() == [[0, 1, 255, 255]]
    assert truth_of(labels, 1).tolist() == [[0, 255, 170, 170]]


def test_masks_must_be_grey(tmp_path):
    path = tmp_path / 'mask.png'
    grey = np.zeros((4, 6), np.uint8)
    grey[1:3] = 255
    cv2.imwrite(str(path), cv2.merge([grey, grey, grey]))
    np.testing.assert_array_equal(read_mask(path, (6, 4)), grey)
    cv2.imwrite(str(path), cv2.merge([grey, grey, 255 - grey]))
    with pytest.raises(SequenceError, match='grey image of 8 bits'):
        read_mask(path, (6, 4))
    cv2.imwrite(str(path), grey.astype(np.uint16))
    with pytest.raises(SequenceError, match='grey image of 8 bits'):
        read_mask(path, (6, 4))
