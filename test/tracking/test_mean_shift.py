# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import dataclasses

import cv2
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from gait_segmentation.geometry import Box, check_matched_box
from gait_segmentation.results import Feedback
from gait_segmentation.tracking import PeopleTracker, TrackingConfig
from gait_segmentation.tracking.mean_shift import mean_shift
from test.walkers import box_of, clip, small_bank

CONFIG = TrackingConfig(
    method='adaptive_mean_shift', use_ego_motion=False, use_texture=False, use_tilt=False
)


def tracker() -> PeopleTracker:
    return PeopleTracker(small_bank(), CONFIG)


def test_the_box_follows_a_walker() -> None:
    made, frames = tracker(), clip(frames=24)
    made.initialize(box_of(frames[0]))
    for frame in frames:
        [track] = made.update(frame.image, frame.stamp_ns)
        assert track.state == 'tracked'
    assert track.box.iou(box_of(frames[-1])) > 0.5
    # What of it the likelihood is made of is told.
    assert sum(each.weight for each in track.features) == pytest.approx(1)
    assert len(track.features) == 5
    inside = frames[-1].masks[0] > 0
    height, width = track.likelihood.shape
    assert (height, width) == inside.shape
    assert track.likelihood[inside].mean() > track.likelihood[~inside].mean() + 60


def test_masks_teach_nothing() -> None:
    one, other = tracker(), tracker()
    frames = clip()
    for made in (one, other):
        made.initialize(box_of(frames[0]))
    for frame in frames[:6]:
        [first] = one.update(frame.image, frame.stamp_ns)
        [second] = other.update(frame.image, frame.stamp_ns)
        one.learn([Feedback(frame.stamp_ns, 1, frame.masks[0], None, frame.masks[0])])
        assert np.array_equal(first.likelihood, second.likelihood)
        assert first.box == second.box


@pytest.mark.parametrize(
    ('rate', 'low', 'high'), [(-0.008, 0.55, 0.8), (0, 0.9, 1.1), (0.008, 1.05, 1.4)]
)
def test_the_box_changes_its_size_with_the_person(rate: float, low: float, high: float) -> None:
    made, frame = tracker(), clip()[0]
    box = box_of(frame)
    made.initialize(box)
    for number in range(40):
        size = 1 + rate * number
        [track] = made.update(zoomed(frame.image, box, size), 10**6 * (1 + number))
    # It grows by less than they do.
    assert low < track.body.height / box.height < high


def zoomed(image: np.ndarray, box: Box, factor: float) -> np.ndarray:
    """Return an image scaled about the middle of a box."""
    matrix = cv2.getRotationMatrix2D((box.center_x, box.center_y), 0, factor)
    size = image.shape[1::-1]
    return np.asarray(cv2.warpAffine(image, matrix, size, borderMode=cv2.BORDER_REFLECT))


@pytest.mark.parametrize('pans', [False, True])
def test_the_box_comes_back_to_who_was_moved_and_a_camera_that_pans_is_no_pace(pans: bool) -> None:
    config = dataclasses.replace(CONFIG, use_ego_motion=pans)
    made, frame = PeopleTracker(small_bank(), config), clip()[0]
    box = box_of(frame)
    made.initialize(box)
    for number in range(9):
        shift = 3 * number if pans else 8 * min(number, 1)
        [track] = made.update(np.roll(frame.image, shift, axis=1), 40_000_000 * (1 + number))
    assert track.body.center_x - box.center_x == pytest.approx(shift, abs=4)
    [found] = made.tracks()
    # The camera pans by 75 pixels a second.
    assert not pans or abs(found.pose.velocity[0]) < 25


@pytest.mark.parametrize(
    'box',
    [
        *(Box(-20, -20, 60, 150), Box(29, -16, 60, 150), Box(20, 20, 1, 8)),
        *(Box(-60, -60, 230, 230), Box(-0.4, 0.015, 1, 8), Box(10, 10, 0.01, 8)),
    ],
)
def test_odd_boxes_are_no_problem(box: Box) -> None:
    made, rng = tracker(), np.random.default_rng(0)
    made.initialize(box)
    for number in range(1, 9):
        noise = rng.integers(0, 256, (60, 60, 3), np.uint8)
        [track] = made.update(noise, number * 40_000_000)
        assert track.likelihood.dtype == np.uint8
        if track.body is not None:
            check_matched_box(track.body, (60, 60))


WINDOW = Box(40, 30, 40, 60)


def likely(dx: int = 0, dy: int = 0, grow: float = 1.0) -> np.ndarray:
    image = np.zeros((140, 160), np.uint8)
    half_w, half_h = 10 * grow, 25 * grow
    image[
        int(60 + dy - half_h) : int(60 + dy + half_h),
        int(57 + dx - half_w) : int(57 + dx + half_w),
    ] = 255
    return image


@settings(max_examples=40)
@given(st.integers(-12, 12), st.integers(-12, 12))
def test_it_finds_where_the_body_went(dx: int, dy: int) -> None:
    shift = mean_shift(likely(dx, dy), likely(), WINDOW)
    assert shift.dx == pytest.approx(dx, abs=1)
    assert shift.dy == pytest.approx(dy, abs=1)
    assert shift.scale == pytest.approx(1, abs=0.02)


def test_it_finds_a_body_whose_window_reaches_over_the_border() -> None:
    shift = mean_shift(likely(-42, -31), likely(-45, -33), WINDOW.shifted(-45, -33))
    assert shift == pytest.approx((3, 2, 1), abs=0.02)


def test_mean_shift_tells_by_how_much_a_person_has_grown() -> None:
    shift = mean_shift(likely(grow=1.2), likely(), WINDOW)
    assert shift.scale == pytest.approx(1.2)


def test_a_box_in_which_nothing_is_likely_stays_as_it_is() -> None:
    nothing = np.zeros_like(likely())
    for weights, reference in (nothing, likely()), (likely(), nothing):
        assert mean_shift(weights, reference, WINDOW) == (0.0, 0.0, 1.0)
