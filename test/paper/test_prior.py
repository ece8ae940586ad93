# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from typing import Any

import cv2
import numpy as np
import pytest

from gait_segmentation.geometry import BodyFrame
from gait_segmentation.paper.prior import (
    EdgePoints,
    Gradient,
    confirmed,
    image_gradient,
    oriented_distance,
    shape_terms,
    silhouette_edges,
)
from gait_segmentation.paper.vocabulary import default_vocabulary
from gait_segmentation.results import MatchResult
from gait_segmentation.segmentation import SegmentationConfig
from gait_segmentation.segmentation.segmenter import Segmenter
from gait_tools.gait_model import render_silhouette

HEIGHT = 100
SHAPE = (124, 96)
BODY = BodyFrame(SHAPE[1] / 2, SHAPE[0] / 2, HEIGHT)


def template() -> np.ndarray:
    drawn = render_silhouette(0.1, 0.0, HEIGHT, fill=0.9)
    prior = np.zeros(SHAPE, np.uint8)
    top, left = (SHAPE[0] - drawn.shape[0]) // 2, (SHAPE[1] - drawn.shape[1]) // 2
    prior[top : top + drawn.shape[0], left : left + drawn.shape[1]] = drawn
    return prior


def clutter() -> np.ndarray:
    image = np.full(SHAPE, 120, np.uint8)
    rng = np.random.default_rng(2)
    for _ in range(40):
        ends = rng.integers(0, 120, 4).tolist()
        cv2.line(image, ends[:2], ends[2:], int(rng.integers(0, 255)), 2)
    return image


def terms(prior: np.ndarray, grey: np.ndarray, **changes: float) -> Any:
    usual = {'reach': 0.12, 'depth': 0.04, 'orientation': 1.0, 'search': 0.01}
    found = shape_terms(
        prior, grey, BODY, default_vocabulary(), **(usual | {'unconfirmed': 0.8} | changes)
    )
    return found and (found.far, found.psi)


def plain_distance(points: EdgePoints) -> np.ndarray:
    mask = np.ones(SHAPE, np.uint8)
    mask[points.rows, points.columns] = 0
    return cv2.distanceTransform(mask, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)


def test_an_edge_of_the_right_orientation_is_nearer_than_one_of_the_wrong() -> None:
    points, gradient = silhouette_edges(template(), HEIGHT), image_gradient(clutter())
    assert gradient.visible.any()
    found = oriented_distance(default_vocabulary(), points, gradient, BODY, 0.0, 12.0)
    # Without a penalty it is the distance of Freedman and Zhang.
    np.testing.assert_allclose(found, np.minimum(plain_distance(points), 12), atol=1e-4)
    visible = np.ones(SHAPE, bool)
    # The back in the middle of the trunk: its gradient is horizontal, theta = 0.
    row = SHAPE[0] // 2 - 15
    column = int(points.columns[points.rows == row].min()) - 2
    costs = []
    for theta in (0.0, np.pi / 2):
        gradient = Gradient(np.full(SHAPE, theta, np.float32), visible, visible)
        found = oriented_distance(default_vocabulary(), points, gradient, BODY, 3.0, 12.0)
        costs.append(found[row, column])
    assert costs[0] == pytest.approx(2, abs=0.7)
    assert costs[1] > costs[0] + 2


def test_an_orientation_has_no_direction() -> None:
    """That from dark to bright is the one from bright to dark, for outlines as for images."""
    for grey in (clutter(), template()):
        here, there = image_gradient(grey), image_gradient(255 - grey)
        steep = here.visible & there.visible
        assert steep.any()
        for each in (here, there):
            assert 0 <= each.orientation.min() < 0.2
            assert 3.0 < each.orientation.max() < np.float32(np.pi)
        turn = np.abs(here.orientation - there.orientation)[steep]
        assert np.minimum(turn, np.pi - turn).max() < 0.01
    one, two = (silhouette_edges(each, HEIGHT) for each in (template(), 255 - template()))
    assert np.abs(one.orientation - two.orientation).max() < 0.01


def test_psi_is_saturated_and_far_pixels_are_background() -> None:
    prior = template()
    far, psi = terms(prior, np.full(SHAPE, 90, np.uint8), reach=0.1)
    assert (psi.min(), psi.max()) == (0, 1)
    away = plain_distance(silhouette_edges(prior, HEIGHT))
    outside = prior <= 127
    # Inside nothing is forced, however far from the outline.
    np.testing.assert_array_equal(far, outside & (away > 10))


def test_inside_psi_rises_as_fast_as_limbs_are_thin() -> None:
    prior = template()
    flat = np.full(SHAPE, 90, np.uint8)
    steep, even = (terms(prior, flat, depth=depth, unconfirmed=1.0)[1] for depth in (0.02, 0.12))
    inside = prior > 127
    np.testing.assert_allclose(steep[inside], np.minimum(6 * even[inside], 1), atol=1e-4)
    np.testing.assert_array_equal(steep[~inside], even[~inside])
    # The thigh is no easier to cut off than the trunk is to cut through.
    thigh, trunk = SHAPE[0] // 2 + 12, SHAPE[0] // 2 - 15
    assert steep[thigh].max(where=inside[thigh], initial=0) == 1
    assert steep[trunk].max(where=inside[trunk], initial=0) == 1


def test_an_unconfirmed_outline_costs_less() -> None:
    prior = template()
    flat = np.full(SHAPE, 90, np.uint8)
    full = terms(prior, flat, unconfirmed=1.0)[1]
    less = terms(prior, flat, unconfirmed=0.8)[1]
    near = (full > 0) & (full < 0.9)
    np.testing.assert_allclose(less[near], 0.8 * full[near], rtol=1e-5)
    # Where the image has the outline itself, it is confirmed nearly everywhere.
    points = silhouette_edges(prior, HEIGHT)
    assert confirmed(points, image_gradient(60 + prior // 2), 1.5).mean() > 0.9
    assert not confirmed(points, image_gradient(flat), 1.5).any()


@pytest.mark.parametrize('rows', [slice(0, 0), slice(0, 124)])
def test_a_template_without_an_outline_adds_nothing(rows: slice) -> None:
    prior = np.zeros(SHAPE, np.uint8)
    prior[rows] = 255
    assert terms(prior, clutter()) is None


def test_the_search_takes_the_least_about_a_pixel() -> None:
    flat = np.full(SHAPE, 90, np.uint8)
    narrow = terms(template(), flat, search=0.0, unconfirmed=1.0)[1]
    wide = terms(template(), flat, search=0.03, unconfirmed=1.0)[1]
    # From a disk of one pixel to one of three, of the twelve in which psi rises to 1 outside.
    middle = (narrow > 0.4) & (narrow < 1) & (template() <= 127)
    np.testing.assert_allclose(narrow[middle] - wide[middle], 2 / 12, atol=0.8 / 12)
    for row, column in np.argwhere(middle)[::20]:
        about = narrow[max(row - 3, 0) : row + 4, max(column - 3, 0) : column + 4]
        assert about.min() - 2 / 12 <= wide[row, column] < narrow[row, column]


def test_the_segmenter_cuts_off_what_is_far_from_the_template() -> None:
    prior = template()
    image = np.full((*SHAPE, 3), 70, np.uint8)
    image[prior > 127] = 180
    image[30:36, 50:94] = 180
    likelihood = cv2.GaussianBlur(image[:, :, 0], (3, 3), 0)
    match = MatchResult(1, 1, BODY, None, 0, 0, 0.1, 1.0, 0.0, 0.9, 1.0, prior)
    masks = {
        name: Segmenter(SegmentationConfig(prior=name)).segment(image, likelihood, match).mask
        for name in ('none', 'paper')
    }
    assert masks['none'][33, 90] == 255
    assert masks['paper'][33, 90] == 0
    inside = prior > 127
    overlap = (masks['paper'] > 0) & inside
    assert overlap.sum() > 0.97 * inside.sum()
