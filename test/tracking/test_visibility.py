# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from gait_segmentation.geometry import Box
from gait_segmentation.images import distance_from
from gait_segmentation.tracking.pixels import Visibility, visible_box
from gait_segmentation.tracking.reidentification import find_silhouette
from test.tracking.figures import Figure

SHAPE = (40, 30)


def block(left: int, top: int, right: int, bottom: int, value: int = 255) -> np.ndarray:
    image = np.zeros(SHAPE, np.uint8)
    image[top:bottom, left:right] = value
    return image


def test_what_others_hide_is_not_seen() -> None:
    mask = block(10, 5, 20, 35)
    sight = Visibility.of(mask, mask, block(0, 20, 30, 40))
    assert sight.share == pytest.approx(0.5)
    assert sight.inside == pytest.approx(1)
    assert (sight.seen, sight.confidence) == pytest.approx((0.5, 0.5))
    np.testing.assert_array_equal(sight.unoccluded, block(10, 5, 20, 20))


def test_what_stands_before_a_person_is_not_looked_at() -> None:
    mask, likely = block(4, 10, 24, 50), block(4, 10, 9, 50)
    sight = Visibility.of(likely, mask, None)
    part = sight.where(block(4, 0, 9, 60, 1) > 0, likely)
    assert (part.share, part.inside) == pytest.approx((0.25, 1.0))
    assert part.seen == pytest.approx(sight.seen)
    assert sight.where(mask < 0, likely).seen == 0
    behind = Visibility.of(likely, mask, block(0, 0, 30, 25))
    assert behind.where(block(4, 0, 9, 60, 1) > 0, likely).share == pytest.approx(0.5 * 0.25)


def test_the_box_is_about_the_likely_pixels_near_the_mask() -> None:
    mask = block(10, 5, 20, 35)
    likely = block(10, 5, 20, 30) | block(26, 5, 28, 35)
    window = (slice(100, 140), slice(50, 80))
    away = distance_from(mask > 127)
    assert visible_box(likely, mask, away, window, 30) == Box(60, 105, 10, 25)
    assert visible_box(block(10, 5, 20, 9), mask, away, window, 30) is None
    nowhere = distance_from(mask > 255)
    assert visible_box(likely, mask, nowhere, window, 30) is None


HEIGHT = 100.0


def silhouette() -> np.ndarray:
    mask = Figure(160).mask()
    rows, columns = np.nonzero(mask)
    return mask[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1]


def middle(figure: Figure) -> tuple[float, float]:
    rows, columns = np.nonzero(figure.mask())
    return (columns.min() + columns.max() + 1) / 2, (rows.min() + rows.max() + 1) / 2


@pytest.mark.parametrize(('x', 'start'), [((240,), 160), ((80, 230), 200), ((230, 80), 100)])
def test_a_silhouette_is_found_where_it_is_and_of_two_the_nearer(x: tuple, start: int) -> None:
    both = np.max([Figure(each).mask() for each in x], axis=0)
    found = find_silhouette(both, silhouette(), (start, 90), HEIGHT, 2.0)
    assert found[:2] == pytest.approx(middle(Figure(x[-1])), abs=0.01)
    assert found[2] > 0.7
    # A row and a column more, which make odd sides even, are part of the cut-out.
    found = find_silhouette(both, np.pad(silhouette(), ((0, 1), (0, 1))), (start, 90), HEIGHT, 2.0)
    right = tuple(each + 0.5 for each in middle(Figure(x[-1])))
    assert found[:2] == pytest.approx(right, abs=0.01)


def test_a_silhouette_out_of_reach_does_not_hide_a_fainter_one_within() -> None:
    both = np.maximum(Figure(100).mask() // 2, Figure(240).mask())
    best, near = (
        find_silhouette(both, silhouette(), (100, 90), HEIGHT, reach) for reach in (3, 1)
    )
    assert best[:2] == pytest.approx(middle(Figure(240)), abs=0.01)
    assert near[:2] == pytest.approx(middle(Figure(100)), abs=0.01)
    assert find_silhouette(both, silhouette(), (-200, 90), HEIGHT, 1)[2] < 0
