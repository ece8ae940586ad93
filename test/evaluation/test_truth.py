# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np

from gait_segmentation.evaluation.truth import labels_of_truth, truth_of


def test_other_people_are_background_of_one():
    labels = np.array([[0, 1, 2, 16, 17, 255]], np.uint8)
    assert truth_of(labels, 2).tolist() == [[0, 0, 255, 0, 170, 170]]
    assert truth_of(labels, 16).tolist() == [[0, 0, 0, 255, 170, 170]]


def test_one_person_is_number_one():
    truth = np.array([[0, 255, 170, 1]], np.uint8)
    labels = labels_of_truth(truth)
    assert labels.tolist() == [[0, 1, 255, 255]]
    assert truth_of(labels, 1).tolist() == [[0, 255, 170, 170]]
