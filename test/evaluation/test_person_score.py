# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.evaluation.attendance import Attendance
from gait_segmentation.evaluation.person_score import PersonScore
from gait_segmentation.results import FeatureWeight

FPS = 10.0


def _attendance(frames: int) -> Attendance:
    labels = np.zeros((40, 100), np.uint8)
    labels[5:35, 20:30] = 1
    return Attendance([(number, labels) for number in range(frames)], FPS, (100, 40))


def test_overlaps_are_averaged_and_frames_without_a_box_counted() -> None:
    score = PersonScore(0)
    for j, box_iou in ((0.9, 0.8), (0.5, 0.1), (0.0, 0.0)):
        score.add(j, box_iou)
    numbers = score.numbers(1, _attendance(3))
    assert numbers['frames'] == 3
    assert numbers['J'] == pytest.approx(1.4 / 3)
    assert numbers['box_iou'] == pytest.approx(0.3)
    assert numbers['lost_frames'] == 2


def test_nothing_is_known_of_somebody_never_seen() -> None:
    numbers = PersonScore(0).numbers(1, _attendance(2))
    assert numbers['J'] is None
    assert numbers['lock_seconds'] is None
    assert numbers['features'] == {}


def test_who_is_held_before_counting_is_locked_but_does_not_switch() -> None:
    score = PersonScore(2)
    for number, track_id in ((1, 4), (2, 5), (3, 5), (4, 6)):
        score.hold(number, track_id)
    numbers = score.numbers(1, _attendance(5))
    assert numbers['ids'] == [5, 6]
    assert numbers['id_switches'] == 1
    assert numbers['lock_seconds'] == pytest.approx(1 / FPS)


def test_features_are_averaged_over_the_frames_that_have_any() -> None:
    score = PersonScore(0)
    score.add_features([])
    score.add_features([FeatureWeight('hue', 2.0, 1.0), FeatureWeight('red', 1.0, 0.0)])
    score.add_features([FeatureWeight('hue', 2.0, 1.0)])
    assert score.numbers(1, _attendance(1))['features'] == {
        'hue': {'weight': 1.0, 'variance_ratio': 2.0},
        'red': {'weight': 0.0, 'variance_ratio': 0.5},
    }


def _seen_in(*frames: int) -> Attendance:
    whole = np.zeros((40, 100), np.uint8)
    whole[5:35, 20:30] = 1
    last = max(frames) + 1
    return Attendance([(n, whole * (n in frames)) for n in range(last)], FPS, (100, 40))


def test_who_is_held_by_less_than_all_of_the_body_is_locked_at_once() -> None:
    score = PersonScore(0)
    score.hold(0, 4)
    labels = [np.zeros((40, 100), np.uint8) for _ in range(3)]
    for number, drawn in enumerate(labels):
        # At the border in the first frame.
        drawn[5:35, 20 * number : 20 * number + 10] = 1
    attendance = Attendance(enumerate(labels), FPS, (100, 40))
    assert attendance.first_whole(1) == 1
    assert score.numbers(1, attendance)['lock_seconds'] == 0


def test_only_returns_while_the_person_counts_are_recoveries() -> None:
    score = PersonScore(4)
    for number in (0, 3, 6):
        score.hold(number, 4)
    attendance = _seen_in(0, 2, 3, 4, 6)
    assert attendance.returns(1) == [2, 6]
    assert score.numbers(1, attendance)['recovery_seconds'] == [0.0]
