# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import sys

import numpy as np
import pytest

from gait_segmentation.evaluation.mot import MotFrame, has_motmetrics, mot_scores


def test_a_switch_a_miss_and_a_false_box():
    pytest.importorskip('motmetrics')
    frames = [
        MotFrame((1,), (7,), np.array([[0.9]])),
        MotFrame((1,), (8,), np.array([[0.9]])),
        MotFrame((1,), (8,), np.array([[0.2]])),
        MotFrame((1,), (), np.zeros((1, 0))),
    ]
    scores = mot_scores(frames)
    # A switch, two misses and a false box in four.
    assert scores['mota'] == pytest.approx(0.0)
    # One identity holds in one frame of four, and three boxes were given.
    assert scores['idf1'] == pytest.approx(2 * 1 / (4 + 3))
    assert has_motmetrics()


def test_without_people_they_are_undefined():
    pytest.importorskip('motmetrics')
    assert mot_scores([MotFrame((), (), np.zeros((0, 0)))]) == {'mota': None, 'idf1': None}


def test_without_the_package_there_are_none(monkeypatch):
    monkeypatch.setitem(sys.modules, 'motmetrics', None)
    assert mot_scores([MotFrame((1,), (7,), np.array([[0.9]]))]) == {}
    assert not has_motmetrics()
