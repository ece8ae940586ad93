# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import math
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra.numpy import arrays

from gait_segmentation.geometry import Box
from gait_tools.evaluation.metrics import (
    BoxScore,
    FrameScore,
    boundary_f,
    evaluation_window,
    jaccard,
    score_frame,
    start_box,
    true_box,
    truth_of,
)
from gait_tools.evaluation.report import Summary, mean_of, place_table
from gait_tools.evaluation.runner import Outcome
from gait_tools.evaluation.tracking_score import Attendance, TrackingScore

from .fakes import found_person


def outcome(j, box_iou=0.5, total=10.0, scored=True):
    boxes = [BoxScore(box_iou / share, (share - 1) / 10) for share in (1, 2, 4, 5)]
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
    return {'sequences': rows, 'mean': mean_of(rows.values())}


def test_numbers_are_means_of_frames_and_medians_of_times(report):
    one, two = report['sequences']['one'], report['sequences']['two']
    assert one['frames'] == 3
    assert one['J'] == pytest.approx(0.7)
    assert one['ms_per_frame']['total'] == 11
    assert one['fps'] == pytest.approx(50)
    assert two['box_iou'] == pytest.approx(0.1)
    assert two['lost_frames'] == 1
    assert two['tracked'] == pytest.approx({'box_iou': 0.05, 'centre_error': 0.1})
    assert two['placed']['box_iou'] == pytest.approx(0.02)
    assert two['matched'] == pytest.approx({'box_iou': 0.025, 'centre_error': 0.3})
    # Every sequence counts the same.
    mean = report['mean']
    assert (mean['J'], mean['frames'], mean['lost_frames']) == (pytest.approx(0.6), 5, 1)
    assert mean['matched']['box_iou'] == pytest.approx((0.125 + 0.025) / 2)
    assert mean['ms_per_frame']['matching'] == 2


def test_places_count_alike(report):
    about = {'kind': 'walk', 'camera': 'static', 'place': 'hall'}
    films = [SimpleNamespace(name=name, about=dict(about)) for name in ('one', 'two', 'three')]
    report['sequences']['three'] = report['sequences']['one']
    films[2].about |= {'camera': 'moving', 'place': 'road'}
    rows = [line.split('  ') for line in place_table(report, films).splitlines()]
    cells = {row[0]: [cell.strip() for cell in row[1:] if cell] for row in rows}
    assert list(cells)[1:] == ['walk', 'walk, moving camera', 'walk, static camera', 'all']
    # Frames with J of 0.5 have not collapsed, and of the other film one of two has.
    assert cells['walk, static camera'][:3] == ['2', '1', '0.6000']
    assert (cells['walk, static camera'][-1], cells['walk, moving camera'][-1]) == ('25.0', '0.0')
    assert cells['all'] == cells['walk'] == ['3', '2', '0.6500', *cells['all'][3:-1], '12.5']
    for film in films:
        del film.about['place']
    assert not place_table(report, films)


def image(text):
    """Turn rows of . (background), # (person) and ? (ambiguous) into a truth image."""
    values = {'.': 0, '#': 255, '?': 170}
    return np.array([[values[c] for c in row] for row in text.split()], np.uint8)


def test_jaccard_leaves_out_ambiguous_pixels():
    truth = image('.##?')
    assert jaccard(image('.##.'), truth) == 1
    assert jaccard(image('.###'), truth) == 1
    assert jaccard(image('..#.'), truth) == 0.5
    assert jaccard(image('####'), truth) == pytest.approx(2 / 3)
    assert jaccard(image('....'), image('..??')) == 1
    assert jaccard(image('#...'), image('..??')) == 0


@pytest.mark.parametrize(
    ('person', 'window'),
    [
        ((40, 60, 50, 70), (35, 65, 45, 75)),
        # Of a thin person, 0.6 times the height wide.
        ((40, 60, 58, 62), (35, 65, 54, 66)),
        ((0, 20, 0, 20), (0, 25, 0, 25)),
        ((0, 0, 0, 0), (0, 100, 0, 200)),
    ],
)
def test_the_window_is_one_and_a_half_times_the_box_in_the_image(person, window):
    truth = np.zeros((100, 200), np.uint8)
    top, bottom, left, right = person
    truth[top:bottom, left:right] = 255
    truth[98, 198] = 170
    assert evaluation_window(truth) == (slice(*window[:2]), slice(*window[2:]))


def test_boxes_of_the_truth():
    truth = np.zeros((40, 60), np.uint8)
    truth[9:31, 9:21] = 170
    truth[10:30, 10:20] = 255
    truth[5:9, 40:50] = 170
    assert true_box(truth) == Box(10, 10, 10, 20)
    assert start_box(truth) == Box(9, 9, 12, 22)
    assert start_box(np.full((5, 5), 170, np.uint8)) is None
    truth = np.full((40, 50), 170, np.uint8)
    truth[15:25, 20:30] = 255
    assert start_box(truth) == Box(16, 11, 18, 18)


def test_boundary_f_equals_the_definition():
    """Compare with distances between boundary pixels computed one by one."""
    rng = np.random.default_rng(5)
    found, truth = (rng.random((2, 14, 17)) > 0.5).astype(np.uint8) * 255

    def boundary(mask):
        points = []
        for y in range(mask.shape[0]):
            for x in range(mask.shape[1]):
                near = mask[y : y + 2, x : x + 2]
                if (near != mask[y, x]).any():
                    points.append((y, x))
        return np.array(points, float)

    a, b = boundary(found), boundary(truth)
    distance = np.hypot(*(a[:, None] - b[None]).transpose(2, 0, 1))
    for tolerance in (0, 1, 2):
        precision = (distance.min(axis=1) <= tolerance).mean()
        recall = (distance.min(axis=0) <= tolerance).mean()
        expected = 2 * precision * recall / (precision + recall)
        assert boundary_f(found, truth, tolerance) == pytest.approx(expected)
    # By default, 0.8 % of the diagonal, rounded up.
    assert boundary_f(found, truth) == boundary_f(found, truth, 1) < 1


@settings(max_examples=50)
@given(
    arrays(np.uint8, (9, 7), elements=st.sampled_from([0, 255])),
    arrays(np.uint8, (9, 7), elements=st.sampled_from([0, 170, 255])),
)
def test_scores_stay_in_range_and_ignore_ambiguous_pixels(mask, truth):
    score = score_frame(mask, None, truth)
    assert 0 <= score.j <= 1
    assert 0 <= score.f <= 1
    assert 0 <= score.error_rate <= 100
    other = np.where((truth != 0) & (truth != 255), 255 - mask, mask)
    again = score_frame(other, None, truth)
    assert (again.j, again.f, again.error_rate) == (score.j, score.f, score.error_rate)
    perfect = score_frame(np.where(truth == 255, truth, 0), None, truth)
    assert (perfect.j, perfect.f, perfect.error_rate_image) == (1, 1, 0)


def test_the_box_is_scored():
    truth = np.zeros((50, 50), np.uint8)
    truth[10:30, 10:20] = 255
    mask = truth.copy()
    moved, right = Box(10, 14, 10, 20), Box(10, 10, 10, 20)
    score = score_frame(mask, right, truth, Box(-5, 10, 20, 20), moved)
    assert score.visible == (1, 0)
    assert score.tracked == pytest.approx((0.25, 0.375))
    assert score.matched == pytest.approx((16 / 24, 0.2))
    assert not score.lost
    assert score_frame(mask, Box(30, 30, 10, 20), truth).lost
    none = score_frame(mask, None, truth)
    assert none.lost
    assert none.visible.iou == none.matched.iou == 0
    assert math.isnan(none.visible.centre_error)


def test_a_frame_without_a_person():
    truth = np.zeros((10, 10), np.uint8)
    empty = score_frame(np.zeros_like(truth), None, truth)
    assert (empty.j, empty.f, empty.lost) == (1, 1, False)
    assert math.isnan(empty.tracked.iou)
    mask = cv2.rectangle(truth.copy(), (2, 2), (5, 5), 255, -1)
    full = score_frame(mask, Box(2, 2, 4, 4), truth)
    assert (full.j, full.f, full.lost) == (0, 0, False)
    assert full.error_rate == 16


def test_other_people_are_background_of_one():
    labels = np.array([[0, 1, 2, 16, 17, 255]], np.uint8)
    assert truth_of(labels, 2).tolist() == [[0, 0, 255, 0, 170, 170]]
    assert truth_of(labels, 16).tolist() == [[0, 0, 0, 255, 170, 170]]
