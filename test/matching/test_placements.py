# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import math

import cv2
import numpy as np
import pytest

from gait_segmentation.geometry import BodyFrame, Box, check_body, check_matched_box
from gait_segmentation.matching import MatchingConfig
from gait_segmentation.matching.placements import (
    PlacementGrid,
    likely_box,
    resampled,
    warp_template,
)
from test.matching.cases import windows_of

CONFIG = MatchingConfig(shifts_x=2, shifts_y=1, scales=1, scale_step=0.06, blur=1)


@pytest.fixture
def grid():
    return PlacementGrid((48, 32), 0.9, CONFIG)


@pytest.mark.parametrize('angle', [0.0, 0.3])
@pytest.mark.parametrize('size', [24.0, 100.0, 260.0])
def test_windows_show_what_stands_at_their_placement(grid, size, angle):
    template = np.zeros((48, 32), np.uint8)
    template[4:44, 12:20] = 255
    template[30:40, 8:24] = 255
    box = Box.from_center(250.0, 240.0, 0.4 * size, size)
    for index in ((1, 1, 2), (0, 0, 0), (2, 2, 3)):
        body = grid.placement(*index, angle).body(box, angle)
        image = warp_template(template, body, 0.9, (500, 500))
        sampled = grid.sample(image, None, box, 1, angle, slice(None))
        assert sampled.known is None
        window = windows_of(sampled.images, grid.windows)[index]
        common = np.minimum(window, template).sum(dtype=float)
        assert common / np.maximum(window, template).sum(dtype=float) > 0.8


def test_the_border_of_the_image_does_not_darken_what_is_just_inside(grid):
    image = np.full((100, 100), 255, np.uint8)
    # Half of what the largest body height takes of a box 40 high, in its own 18 columns.
    half = 18 * 1.06 * 40 / (0.9 * 48)
    for tenth in range(-5, 10):
        box = Box.from_center(half + tenth / 10, 50, 20, 40)
        sampled = grid.sample(image, None, box, 1, 0.0, slice(None))
        expected = 255 if sampled.known is None else sampled.known
        assert (sampled.images == expected).all()


def test_what_is_finer_than_the_templates_is_averaged(grid):
    rows, columns = np.mgrid[:400, :400]
    board = np.where((rows + columns) % 2, 255, 0).astype(np.uint8)
    for size in (100.0, 150.0, 200.0):
        box = Box.from_center(200, 200, 80, size)
        sampled = grid.sample(board, None, box, 1, 0.0, slice(None))
        assert np.abs(sampled.images.astype(int) - 127).max() <= 30


@pytest.mark.parametrize('sign', [-1, 1])
def test_no_parameters_make_a_body_that_makes_no_sense(sign: int) -> None:
    config = MatchingConfig(scales=5, scale_step=0.3, shifts_x=16, shifts_y=16, shift_step=0.1)
    grid = PlacementGrid((128, 88), 0.85, config)
    size = (320, 240)
    # As large and as far away as it may be, and half a step beyond the last placement.
    box = Box.from_center(160 + sign * 2559, 120 + sign * 2559, 9, 2560)
    check_matched_box(box, size)
    scales, rows, columns = grid.everywhere.shape
    last = (scales - 0.5, rows - 0.5, columns - 0.5) if sign > 0 else (scales - 0.5, -0.5, -0.5)
    for angle in (0.0, 0.7, 3.0):
        check_body(grid.placement(*last, angle).body(box, angle), size)


def test_a_part_is_sampled_as_the_whole_is_smoothed():
    rng = np.random.default_rng(0)
    image = rng.integers(0, 256, (60, 80), dtype=np.uint8)
    known = np.where(rng.random(image.shape) < 0.6, 255, 0).astype(np.uint8)
    # Pixels of the grid are those of the image from (20, 15) on.
    grid = BodyFrame(35.0, 28.0, 20.0), (1.0,), (26, 30), 20.0
    for mask in (None, known):
        values = image if mask is None else image & mask
        whole = cv2.blur(values, (9, 9))
        if mask is not None:
            whole = cv2.divide(whole, cv2.blur(mask, (9, 9)), scale=255) & mask
        (found,), seen = resampled(image, mask, *grid, 9)
        np.testing.assert_array_equal(found, whole[15:41, 20:50])
        assert (seen is None) == (mask is None)


@pytest.mark.parametrize(('x', 'y'), [(-1, 0), (0, -1), (51, 0), (0, 35)])
def test_what_is_outside_of_the_image_is_not_known(x, y):
    grid = BodyFrame(15.0 + x, 13.0 + y, 20.0), (1.0,), (26, 30), 20.0
    (found,), seen = resampled(np.full((60, 80), 255, np.uint8), None, *grid, 1)
    assert 0 < (seen == 0).sum() <= 30
    np.testing.assert_array_equal(found, seen[0])


@pytest.fixture
def template():
    image = np.zeros((40, 30), np.uint8)
    image[2:38, 10:20] = 255
    return image


BODY = 80.0
PLACE = (slice(10, 106), slice(8, 72))
TWICE = np.array([[2.0, 0.0, 100.0], [0.0, 2.0, 50.0]])


def upright():
    image = np.zeros((96, 64), np.uint8)
    image[8:88, 24:40] = 255
    return image


def likelihood(rows, columns):
    image = np.zeros((116, 84), np.uint8)
    image[rows, columns] = 255
    return image


def sides(box):
    return [box.x, box.y, box.right, box.bottom]


def test_the_box_is_that_of_what_is_likely_where_the_template_stands():
    """Who carries something is broader than the template, and may be shorter."""
    image = likelihood(slice(24, 96), slice(28, 52))
    for clutter in (False, True):
        if clutter:
            # Far from the template, thin, or unlikely.
            image[20:60, 70:80] = image[22, 40] = image[60, 54] = 255
            image[24:96, 52:54] = 180
        box = likely_box(image, upright(), PLACE, BODY, TWICE)
        assert (box.x, box.y, box.right, box.bottom) == pytest.approx((156, 98, 204, 242))


def test_the_box_is_upright_where_the_body_leans():
    angle = math.radians(30)
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    to_source = np.column_stack([turn, [0.0, 0.0]])
    image = likelihood(slice(24, 96), slice(32, 48))
    box = likely_box(image, upright(), PLACE, BODY, to_source)
    assert box.height == pytest.approx(72 * math.cos(angle) + 16 * math.sin(angle), abs=1.5)


def test_shifts_are_in_heights_of_the_body_in_question(grid):
    small, large = (grid.placement(scale, 1, 3) for scale in (0, 2))
    assert large.scale / small.scale == pytest.approx(1.06**2)
    assert large.dx / small.dx == pytest.approx(1.06**2)
