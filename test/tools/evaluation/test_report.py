# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import math

import numpy as np
import pytest

from gait_segmentation.geometry import Box
from gait_tools.evaluation.metrics import BoxScore, FrameScore
from gait_tools.evaluation.report import (
    Summary,
    mean_of,
    restart_report,
    table,
)
from gait_tools.evaluation.runner import Outcome
from gait_tools.evaluation.tracking_score import Attendance, TrackingScore

from .fakes import found_person


def outcome(j, box_iou=0.5, total=10.0, scored=True):
    boxes = [BoxScore(box_iou / share, (share - 1) / 10) for share in (1, 2, 4)]
    score = FrameScore(j, 0.5, 1.0, 0.1, *boxes)
    times = {'tracking': 1.0, 'matching': 2.0, 'segmentation': 3.0, 'total': total}
    return Outcome(0, None, None, times, 0.02, score if scored else None)


def tracking(held):
    """Score one frame with one person, who is held or not."""
    labels = np.zeros((20, 30), np.uint8)
    labels[4:16, 10:14] = 1
    attendance = Attendance([(0, labels)], 25.0, (30, 20))
    score = TrackingScore(attendance, {1: 0})
    score.add(0, labels, [found_person(5, Box(10, 4, 4, 12), labels * 255)] if held else [])
    return score


@pytest.fixture
def report():
    first, second = Summary(tracking(True)), Summary(tracking(False))
    for j, total in ((0.5, 10), (0.7, 12), (0.9, 500)):
        first.add(outcome(j, total=total), None)
    first.add(outcome(0, scored=False), None)
    second.add(outcome(1.0, box_iou=math.nan), None)
    second.add(outcome(0.0, box_iou=0.1), None)
    rows = {'one': first.numbers(), 'two': second.numbers()}
    return {'sequences': rows, 'mean': mean_of(rows)}


def test_numbers_are_means_of_frames_and_medians_of_times(report):
    one, two = report['sequences']['one'], report['sequences']['two']
    assert one['frames'] == 3
    assert one['J'] == pytest.approx(0.7)
    assert one['ms_per_frame']['total'] == 11
    assert one['fps'] == pytest.approx(50)
    assert two['box_iou'] == pytest.approx(0.1)
    assert two['lost_frames'] == 1
    assert two['tracked'] == pytest.approx({'box_iou': 0.05, 'centre_error': 0.1})
    assert two['matched'] == pytest.approx({'box_iou': 0.025, 'centre_error': 0.3})


def test_every_sequence_counts_the_same(report):
    assert report['mean']['J'] == pytest.approx(0.6)
    assert report['mean']['frames'] == 5
    assert report['mean']['matched']['box_iou'] == pytest.approx((0.125 + 0.025) / 2)
    assert report['mean']['lost_frames'] == 1
    assert report['mean']['ms_per_frame']['matching'] == 2


def test_restarts_are_averaged_per_sequence_first(report):
    restarts = restart_report({'one': {0: [0.6, 1.0], 10: [0.4, 0.8]}, 'two': {0: [1.0]}})
    assert restarts['J'] == pytest.approx(0.85)
    assert restarts['J0'] == pytest.approx(0.75)
    assert restarts['per_sequence']['one']['starts']['10'] == {
        'J': pytest.approx(0.6),
        'J0': 0.4,
    }
    assert restart_report({'short': {}})['J'] is None
    text = table({**report, 'restarts': restarts})
    assert 'restart J' in text
    assert '0.8500' in text.splitlines()[-1]
