# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import math

import cv2
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra.numpy import arrays

from gait_segmentation.errors import InputError
from gait_segmentation.geometry import Box
from gait_tools.evaluation.metrics import (
    boundary_f,
    error_percent,
    evaluation_window,
    jaccard,
    mean_known,
    score_frame,
    start_box,
    true_box,
)


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


def test_jaccard_of_two_empty_masks_is_one():
    assert jaccard(image('....'), image('..??')) == 1
    assert jaccard(image('#...'), image('..??')) == 0


def test_error_percent_counts_known_pixels_only():
    assert error_percent(image('#..#'), image('.#.?')) == pytest.approx(200 / 3)
    assert error_percent(image('##'), image('??')) == 0


def test_the_window_is_one_and_a_half_times_the_box():
    truth = np.zeros((100, 200), np.uint8)
    truth[40:60, 50:70] = 255
    assert evaluation_window(truth) == (slice(35, 65), slice(45, 75))


def test_the_window_of_a_thin_person_is_not_too_thin():
    truth = np.zeros((100, 200), np.uint8)
    truth[40:60, 58:62] = 255
    assert evaluation_window(truth) == (slice(35, 65), slice(54, 66))


def test_the_window_is_clipped_and_ignores_ambiguous_pixels():
    truth = np.zeros((30, 40), np.uint8)
    truth[0:20, 0:20] = 255
    truth[28, 38] = 170
    assert evaluation_window(truth) == (slice(0, 25), slice(0, 25))


def test_the_window_without_a_person_is_the_image():
    assert evaluation_window(np.zeros((3, 5), np.uint8)) == (slice(0, 3), slice(0, 5))


def test_boxes_of_the_truth():
    truth = np.zeros((40, 60), np.uint8)
    truth[9:31, 9:21] = 170
    truth[10:30, 10:20] = 255
    truth[5:9, 40:50] = 170
    assert true_box(truth) == Box(10, 10, 10, 20)
    assert start_box(truth) == Box(9, 9, 12, 22)
    assert start_box(np.full((5, 5), 170, np.uint8)) is None


def test_the_rim_about_a_person_is_4_pixels_wide():
    truth = np.full((40, 50), 170, np.uint8)
    truth[15:25, 20:30] = 255
    assert start_box(truth) == Box(16, 11, 18, 18)


def test_boundary_f_of_known_cases():
    truth = np.zeros((40, 40), np.uint8)
    truth[10:30, 10:30] = 255
    assert boundary_f(truth, truth) == 1
    assert boundary_f(np.zeros_like(truth), truth) == 0
    assert boundary_f(truth, np.zeros_like(truth)) == 0
    assert boundary_f(np.zeros_like(truth), np.zeros_like(truth)) == 1
    moved = np.roll(truth, 1, axis=1)
    assert boundary_f(moved, truth) == 1  # the tolerance is one pixel
    assert boundary_f(moved, truth, tolerance=0) < 0.6
    assert boundary_f(np.roll(truth, 6, axis=1), truth) < 0.8


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


def test_masks_of_another_shape_are_refused():
    with pytest.raises(InputError, match=r'\(3, 4\)'):
        score_frame(np.zeros((4, 3), np.uint8), None, np.zeros((3, 4), np.uint8))


def test_scores_are_plain_numbers_also_for_boxes_of_numpy_numbers():
    truth = np.zeros((50, 50), np.uint8)
    truth[10:30, 10:20] = 255
    score = score_frame(truth, Box(*np.array([10.0, 10.0, 10.0, 20.0])), truth)
    assert type(score.lost) is bool
    assert {type(value) for value in (score.j, score.f, score.error_rate, score.visible.iou)} == {
        float
    }


def test_what_is_missing_does_not_count() -> None:
    assert mean_known([1.0, None, 2.0, math.nan]) == pytest.approx(1.5)
    assert mean_known([None, math.nan]) is None
