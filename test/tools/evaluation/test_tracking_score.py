# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import json
import sys

import numpy as np
import pytest

from gait_segmentation.geometry import Box
from gait_segmentation.results import FeatureWeight
from gait_tools.evaluation.attendance import Attendance
from gait_tools.evaluation.tracking_score import (
    PersonScore,
    TrackingScore,
    first_frames,
    mot_scores,
)

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


def track(track_id, x, width=10, features=()):
    return found_person(track_id, Box(x, 5, width, 30), mask_at(x, width), features)


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


def test_perfect_tracks_have_perfect_scores():
    truth = [{1: 10 + n, 2: 60 - n} for n in range(10)]
    numbers = score(truth, [{4: 10 + n, 9: 60 - n} for n in range(10)])
    assert numbers['J'] == numbers['J_one_id'] == numbers['box_iou'] == 1
    assert numbers['centre_error'] == 0
    assert numbers['people']['1']['ids'] == [4]
    assert numbers['people']['2']['ids'] == [9]
    names = ('lost_frames', 'id_switches', 'shared_ids', 'false_slots', 'false_frames')
    assert [numbers[name] for name in names] == [0] * 5
    assert numbers['lock_seconds'] == 0
    assert numbers['recovery_seconds'] is None


def test_exchanged_ids_are_two_switches_but_cost_no_overlap():
    truth = [{1: 10, 2: 60} for _ in range(10)]
    found = [{4: 10, 9: 60} if n < 6 else {4: 60, 9: 10} for n in range(10)]
    numbers = score(truth, found)
    assert numbers['J'] == 1
    assert numbers['J_one_id'] == pytest.approx(0.6)
    assert numbers['id_switches'] == 2
    assert numbers['shared_ids'] == 2
    assert numbers['people']['1']['ids'] == [4, 9]


def test_who_is_held_stays_with_the_track_while_both_fit():
    truth = [{1: 20}] * 3
    numbers = score(truth, [{4: 20}, {4: 22, 9: 20}, {9: 20, 4: 22}])
    assert numbers['id_switches'] == 0
    assert numbers['people']['1']['ids'] == [4]


def test_who_is_hidden_for_a_while_stays_with_the_track_of_before():
    numbers = score([{1: 20}, {}, {1: 20}], [{4: 20}, {}, {4: 22, 9: 20}])
    assert numbers['people']['1']['ids'] == [4]


def test_of_two_tracks_the_one_with_the_better_mask_is_the_persons():
    labels = labels_of({1: 20})
    scores = TrackingScore(Attendance([(0, labels)], FPS, SIZE), {1: 0})
    # The boxes are the other way round.
    tracks = [
        found_person(4, Box(22, 5, 10, 30), mask_at(26)),
        found_person(9, Box(26, 5, 10, 30), mask_at(22)),
    ]
    scores.add(0, labels, tracks)
    numbers = scores.numbers()
    assert numbers['J'] == pytest.approx(8 / 12)
    assert numbers['box_iou'] == pytest.approx(4 / 16)


def test_nobody_there_is_lost_frames_and_no_overlap():
    truth = [{1: 20}] * 4
    numbers = score(truth, [{4: 20}, {}, {4: 70}, {4: 22}])
    assert numbers['lost_frames'] == 2
    # Shifted by 2 of 10 columns: 8 common of 12.
    assert numbers['J'] == pytest.approx((1 + 8 / 12) / 4)
    assert numbers['centre_error'] == pytest.approx((0 + 2 / 30) / 2)
    assert numbers['false_frames'] == 1
    assert numbers['false_slots'] == 0


def test_a_track_that_never_is_on_anybody_is_a_false_slot():
    numbers = score([{1: 20}] * 3, [{4: 20}, {4: 20, 5: 70}, {4: 20, 5: 70}])
    assert numbers['false_slots'] == 1
    assert numbers['false_frames'] == 2


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


def test_people_count_from_their_box_on():
    truth = [{1: 10, 2: 60} for _ in range(10)]
    found = [{4: 10} if n < 4 else {4: 10, 9: 60} for n in range(10)]
    starts = {0: (Box(10, 5, 10, 30),), 4: (Box(60, 5, 10, 30),)}
    numbers = score(truth, found, starts)
    assert numbers['lost_frames'] == 0
    assert numbers['people']['2']['frames'] == 6
    assert score(truth, found)['lost_frames'] == 4


def test_switches_are_those_of_motmetrics():
    motmetrics = pytest.importorskip('motmetrics')
    rng = np.random.default_rng(3)
    truth = [{1: 10 + n, 2: 40 + n, 3: 90 - n} for n in range(30)]
    found = []
    for people in truth:
        ids = rng.permutation([4, 5, 6]) if rng.random() < 0.2 else [4, 5, 6]
        found.append(
            {int(i): x for i, x in zip(ids, people.values(), strict=True) if rng.random() < 0.9}
        )
    numbers = score(truth, found)
    assert numbers['id_switches'] > 4
    accumulator = motmetrics.MOTAccumulator(auto_id=True)
    for people, tracks in zip(truth, found, strict=True):
        overlap = [
            [Box(a, 5, 10, 30).iou(Box(b, 5, 10, 30)) for b in tracks.values()]
            for a in people.values()
        ]
        distance = 1 - np.array(overlap).reshape(len(people), len(tracks))
        distance[distance > 0.5] = np.nan
        accumulator.update(list(people), list(tracks), distance)
    known = motmetrics.metrics.create().compute(
        accumulator, metrics=['num_switches', 'mota'], return_dataframe=False
    )
    # Where three people cross one may cover the other: frames in which not all three count.
    assert numbers['id_switches'] == pytest.approx(known['num_switches'], abs=1)
    assert numbers['mota'] == pytest.approx(known['mota'], abs=0.1)


def test_features_are_those_of_the_track_that_is_the_person():
    labels = labels_of({1: 20})
    scores = TrackingScore(Attendance([(0, labels)], FPS, SIZE), {1: 0})
    own, other = (FeatureWeight(name, 2.0, 1.0) for name in ('hue', 'red'))
    tracks = [track(5, 70, features=(other,)), track(4, 20, features=(own,))]
    scores.add(0, labels, tracks)
    assert scores.numbers()['people']['1']['features'] == {
        'hue': {'weight': 1.0, 'variance_ratio': 2.0}
    }


def test_a_switch_a_miss_and_a_false_box():
    pytest.importorskip('motmetrics')
    frames = [
        ((1,), (7,), np.array([[0.9]])),
        ((1,), (8,), np.array([[0.9]])),
        ((1,), (8,), np.array([[0.2]])),
        ((1,), (), np.zeros((1, 0))),
    ]
    scores = mot_scores(frames)
    # A switch, two misses and a false box in four.
    assert scores['mota'] == pytest.approx(0.0)
    # One identity holds in one frame of four, and three boxes were given.
    assert scores['idf1'] == pytest.approx(2 * 1 / (4 + 3))


def test_without_people_they_are_undefined():
    pytest.importorskip('motmetrics')
    assert mot_scores([((), (), np.zeros((0, 0)))]) == {'mota': None, 'idf1': None}


def test_without_the_package_there_are_none(monkeypatch):
    monkeypatch.setitem(sys.modules, 'motmetrics', None)
    assert mot_scores([((1,), (7,), np.array([[0.9]]))]) == {}


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
