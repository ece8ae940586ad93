# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import cv2
import numpy as np
import pytest

from gait_segmentation.colour import ColourModel, colour_bins
from gait_segmentation.geometry import BodyFrame
from gait_segmentation.tracking.person import Person

SHAPE = (240, 320)


def ellipse(x: float, y: float, height: float, degrees: float = 0.0) -> np.ndarray:
    mask = np.zeros(SHAPE, np.uint8)
    axes = (round(height / 6), round(height / 2))
    cv2.ellipse(mask, (round(x), round(y)), axes, degrees, 0, 360, 255, -1)
    return mask


def person(x: float = 100, y: float = 120, height: float = 100) -> Person:
    colours = ColourModel(0.7, 1e-4), ColourModel(0.7, 1e-4)
    return Person(x, y, height, 20, 20, ellipse(x, y, height), *colours)


@pytest.mark.parametrize('degrees', [0, 20])
def test_place_and_size_follow_the_masks_in_the_frame_of_the_body(degrees: int) -> None:
    state = person()
    # A single bad mask changes little.
    state.learn_place(ellipse(100, 120, 20), BodyFrame(100, 120, 20))
    assert state.height >= 98
    state.tilt = state.angle = np.radians(degrees)
    for _ in range(40):
        body = BodyFrame(108, 123, 108, state.angle)
        state.learn_place(ellipse(108, 123, 108, degrees), body)
    found = state.center_x, state.center_y, state.height
    assert found == pytest.approx((108, 123, 108), abs=2)
    assert state.box.width == pytest.approx(36, abs=3)


def test_without_masks_the_size_follows_mean_shift_up_to_a_limit() -> None:
    state = person(height=100)
    for _ in range(60):
        state.follow_scale(1.1)
    assert state.height == pytest.approx(110, abs=0.5)
    assert state.box.width == pytest.approx(44, abs=0.5)
    for _ in range(60):
        state.follow_scale(3.0)
    assert state.height == pytest.approx(115, abs=0.5)


def test_a_body_that_leaves_below_keeps_its_height_and_hangs_from_the_head() -> None:
    state = person(y=180, height=100)
    for top in (140, 150, *[160] * 20):
        mask = np.zeros(SHAPE, np.uint8)
        mask[top:, 90:110] = 255
        state.learn_place(mask, BodyFrame(100, top + 50, 100))
    assert state.height == pytest.approx(100, abs=3)
    assert state.center_y - state.height / 2 == pytest.approx(160, abs=3)


def test_somebody_who_comes_in_from_below_is_at_least_as_tall_as_what_is_seen() -> None:
    height = SHAPE[0]
    state = person(y=height - 20, height=60)
    for top in range(height - 60, height - 120, -6):
        mask = np.zeros(SHAPE, np.uint8)
        mask[top:, 80:120] = 255
        state.learn_place(mask, BodyFrame(100, top + 30, 60))
    assert state.height >= 110
    assert state.center_y - state.height / 2 == pytest.approx(top, abs=3)
    mask[:] = 0
    mask[top:, 40:160] = 255
    for _ in range(10):
        state.learn_place(mask, BodyFrame(100, top + 30, 60))
    assert state.height >= 190


def test_the_first_step_sets_the_pace() -> None:
    state = person()
    state.move((1.0, 0.0), (5.0, 1.0), 0.04)
    assert state.velocity == pytest.approx((100.0, 25.0))
    state.move((1.0, 0.0), (7.0, 1.0), 0.04)
    assert state.velocity == pytest.approx((125.0, 25.0))
    assert state.way(0.1) == pytest.approx((12.5, 2.5))


def test_colours_far_outside_of_the_template_are_not_learnt() -> None:
    state = person()
    lab = np.full((*SHAPE, 3), 100, np.uint8)
    lab[:, 150:] = (200, 60, 60)
    mask = ellipse(100, 120, 100)
    mask[100:140, 150:165] = 255
    window = state.window(SHAPE)
    state.learn_colours(lab[window], window, mask, ellipse(100, 120, 100), (1.0, 1.0))
    assert np.count_nonzero(state.person.whole()) == 1
    state.learn_colours(lab[window], window, mask, None, (1.0, 1.0))
    assert np.count_nonzero(state.person.whole()) == 2


def test_a_shadow_on_known_ground_is_the_persons_only_inside_the_template() -> None:
    state, template = person(), ellipse(100, 120, 100)
    lab = np.full((*SHAPE, 3), 100, np.uint8)
    lab[160:] = (40, 100, 100)
    mask = template.copy()
    mask[160:175, 90:125] = 255
    window = state.window(SHAPE)
    shaded = colour_bins(lab[170:171, 100:101])[0, 0]
    shares = []
    for familiar in (None, lab[window][..., 0] < 100):
        rates = (1.0, 1.0)
        state.learn_colours(lab[window], window, mask, template, rates, familiar)
        shares.append(float(state.person.whole()[shaded]))
    assert 0 < shares[1] < 0.7 * shares[0]


def test_what_may_be_either_counts_for_both_at_first() -> None:
    state, lab = person(), np.full((*SHAPE, 3), 100, np.uint8)
    lab[145:160, 85:115] = (20, 128, 128)
    votes = ellipse(100, 120, 100).astype(np.float32) / 255
    votes[140:165, 80:120] = 0.4
    state.learn_first_colours(lab, votes)
    index = colour_bins(lab[150:151, 100:101])[0, 0]
    assert min(model.table[index].max() for model in (state.person, state.surroundings)) > 1e-3


def test_masks_of_another_size_teach_nothing() -> None:
    state = person()
    prior = ellipse(100, 120, 100)
    assert state.teaches(prior, prior)
    assert not state.teaches(ellipse(100, 120, 30), prior)
    assert not state.teaches(np.full(SHAPE, 255, np.uint8), prior)
    assert not state.teaches(np.zeros(SHAPE, np.uint8), np.zeros(SHAPE, np.uint8))


def test_parts_of_pixels_by_which_a_mask_is_carried_on_add_up() -> None:
    state = person()
    for _ in range(5):
        state.carry(0.4, -0.6)
    np.testing.assert_array_equal(state.mask, np.roll(ellipse(100, 120, 100), (-3, 2), (0, 1)))


@pytest.mark.parametrize('side', [-1, 1])
def test_a_tilt_is_used_from_a_large_one_on_until_it_is_small(side: int) -> None:
    leaning = person()
    for degrees, used in ((7.5, False), (5.0, False), (20.0, True), (7.5, True), (0.0, False)):
        for _ in range(40):
            leaning.learn_angle(ellipse(100, 120, 100, side * degrees))
        assert np.degrees(leaning.angle) == pytest.approx(side * degrees * used, abs=2)
