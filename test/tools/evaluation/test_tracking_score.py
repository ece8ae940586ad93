# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import json

import numpy as np
import pytest

from gait_segmentation.geometry import Box
from gait_tools.evaluation.tracking_score import Attendance, TrackingScore, first_frames

from .fakes import found_person

SIZE = (100, 40)
FPS = 10.0


def labels_of(people):
    drawn = np.zeros((SIZE[1], SIZE[0]), np.uint8)
    for person, x in people.items():
        drawn[5:35, x : x + 10] = person
    return drawn


def mask_at(x, width=10):
    mask = np.zeros((SIZE[1], SIZE[0]), np.uint8)
    mask[5:35, x : x + width] = 255
    return mask


def track(track_id, x, width=10):
    return found_person(track_id, Box(x, 5, width, 30), mask_at(x, width))


def score(truth, found, starts=None):
    """Score lists of {person: x} and {track id: x or (x, width)}, one entry a frame."""
    frames = [(n, labels_of(people)) for n, people in enumerate(truth)]
    attendance = Attendance(frames, FPS, SIZE)
    scores = TrackingScore(attendance, first_frames(attendance, starts or {}))
    for (number, labels), tracks in zip(frames, found, strict=True):
        made = [track(i, *(x if isinstance(x, tuple) else (x,))) for i, x in tracks.items()]
        scores.add(number, labels, made)
    numbers = scores.numbers()
    json.dumps(numbers)
    return numbers


def test_exchanged_ids_are_two_switches_but_cost_no_overlap():
    truth = [{1: 10, 2: 60} for _ in range(10)]
    found = [{4: 10, 9: 60} if n < 6 else {4: 60, 9: 10} for n in range(10)]
    numbers = score(truth, found)
    assert numbers['J'] == numbers['box_iou'] == 1
    assert numbers['lost_frames'] == numbers['false_frames'] == numbers['lock_seconds'] == 0
    assert numbers['J_one_id'] == pytest.approx(0.6)
    assert numbers['id_switches'] == 2
    assert numbers['shared_ids'] == 2
    # Two switches among twenty places, if there is motmetrics.
    assert numbers.get('mota', 0.9) == pytest.approx(0.9)
    assert numbers['people']['1']['ids'] == [4, 9]


def test_nobody_there_is_lost_frames_and_no_overlap():
    truth = [{1: 20}] * 4
    numbers = score(truth, [{4: 20}, {}, {4: 70}, {4: 22}])
    assert numbers['lost_frames'] == 2
    # Shifted by 2 of 10 columns: 8 common of 12.
    assert numbers['J'] == pytest.approx((1 + 8 / 12) / 4)
    assert numbers['centre_error'] == pytest.approx((0 + 2 / 30) / 2)
    assert numbers['false_frames'] == 1
    assert numbers['false_slots'] == 0


def test_who_knows_what_is_in_ambiguous_pixels():
    frames = [(0, labels_of({1: 20, 200: 70}))]
    attendance = Attendance(frames, FPS, SIZE)
    assert attendance.people == (1,)
    scores = TrackingScore(attendance, {1: 0})
    unclear = track(5, 71)
    empty = found_person(6, unclear.track.box, np.zeros_like(mask_at(71)))
    wide = found_person(7, Box(60, 0, 35, 40), mask_at(71))
    scores.add(0, frames[0][1], [track(4, 20), unclear, empty, wide])
    assert scores.numbers()['false_slots'] == 0
    scores.add(0, frames[0][1], [track(8, 76)])
    assert scores.numbers()['false_slots'] == 1


def test_times_to_lock_and_to_recover():
    truth = [{} if n < 5 or 15 <= n < 20 else {1: 20} for n in range(30)]
    found = [{4: 20} if 8 <= n < 15 or n >= 24 else {} for n in range(30)]
    numbers = score(truth, found)
    assert numbers['lock_seconds'] == pytest.approx(0.3)
    assert numbers['recovery_seconds'] == pytest.approx(0.4)
    assert numbers['id_switches'] == 0
    # Frames 5 to 7 and 20 to 23.
    assert numbers['lost_frames'] == 7
    assert numbers['people']['1']['frames'] == 20
    never = score(truth, [{4: 20} if n == 8 else {} for n in range(30)])
    assert never['never_recovered'] == 1
    assert score(truth, [{}] * 30)['never_locked'] == 1
