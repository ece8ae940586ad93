# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import cv2
import numpy as np
import pytest

from gait_segmentation.detector.map_regions import BodyShapes, MapRegions, normalised
from gait_segmentation.gait_model import default_bank
from gait_segmentation.geometry import Box
from gait_segmentation.heat_maps import HeatMap
from test.walkers import body

SOURCE = (240, 320)
SHAPES = BodyShapes(default_bank())
SURE = 0.6


def heat(number, *regions, trust=1.0):
    """Return the map of a frame at half the size of the source, with regions (left, top, what)."""
    values = np.zeros((120, 160), np.uint8)
    for left, top, region in regions:
        values[top : top + region.shape[0], left : left + region.shape[1]] = region
    return HeatMap(values, 1 + number, trust)


def sure(*args, regions=None):
    """Return the boxes of who is found for certain."""
    found = (regions or MapRegions(SHAPES)).detect(*args)
    return [each.box for each in found if each.score >= SURE and each.by_map]


def test_people_are_found_by_the_shape_of_a_body_once_in_each_map_that_is_trusted():
    regions, shown = MapRegions(SHAPES), [(20, 30, body()), (90, 20, body((36, 80), 8))]
    assert sure(heat(0, *shown, trust=0.0), SOURCE, 20, [], regions=regions) == []
    squeezed = HeatMap(cv2.resize(heat(0, *shown).values, (80, 120)), 9, 1.0)
    for given in (heat(0, *shown), squeezed):
        found = sure(given, SOURCE, 20, [], regions=regions)
        assert sorted((box.x, box.y, box.width, box.height) for box in found) == [
            pytest.approx((40, 60, 60, 120), abs=4),
            pytest.approx((180, 40, 72, 160), abs=4),
        ]
    regions.detect(heat(0, *shown), SOURCE, 20, [])
    assert sure(heat(0, *shown), SOURCE, 20, [], regions=regions) == []


def test_a_region_has_its_shape_whatever_the_proportions_of_the_pixels():
    shape = body((40, 90)).astype(np.uint8)
    squeezed = cv2.resize(shape, (20, 90), interpolation=cv2.INTER_AREA)
    found = normalised(squeezed, 40 / 90).astype(int)
    assert np.abs(found - normalised(shape)).mean() < 3


def test_whoever_is_tracked_is_not_found_again_and_what_hangs_together_with_them_is_theirs():
    tracked = [Box(36, 56, 66, 130)]
    touching = np.zeros((60, 64), np.uint8)
    assert sure(heat(0, (20, 30, body())), SOURCE, 20, tracked) == []
    touching[:, :30] = touching[:, 34:] = body()
    touching[50:, 25:40] = 255
    assert sure(heat(1, (20, 30, touching)), SOURCE, 20, tracked) == []
    touching[:, 30:34] = 0
    assert len(sure(heat(2, (20, 30, touching)), SOURCE, 20, tracked)) == 1


@pytest.mark.parametrize('size', [(60, 30), (100, 8), (6, 12)])
def test_what_lies_or_is_tiny_is_nobody(size):
    assert sure(heat(0, (20, 30, np.full(size[::-1], 255, np.uint8))), SOURCE, 30, []) == []


def test_what_has_nothing_of_the_shape_of_a_body_is_not_told_of():
    bar = heat(0, (20, 30, np.full((8, 100), 255, np.uint8)))
    assert MapRegions(SHAPES).detect(bar, SOURCE, 10, []) == []


def test_what_is_less_clear_has_a_lower_score():
    square = np.full((60, 46), 255, np.uint8)
    (doubtful,) = MapRegions(SHAPES).detect(heat(0, (20, 30, square)), SOURCE, 20, [])
    (clear,) = MapRegions(SHAPES).detect(heat(0, (20, 30, body())), SOURCE, 20, [])
    assert 0.3 < doubtful.score < SURE < clear.score


@pytest.mark.parametrize('child', [False, True])
def test_a_part_that_the_network_is_sure_of_is_nobody_beside_the_whole(child):
    """Even if it has more of the shape of a body than the whole, as a print on a dress."""
    whole = body((40, 90)).astype(np.uint8) // 4
    if child:
        whole = cv2.dilate(whole, np.ones((7, 7), np.uint8))
        whole[25:70, 10:30] = np.maximum(whole[25:70, 10:30], body((20, 45)))
    else:
        whole[50:, 12:28] = 255
    (found,) = sure(heat(0, (20, 10, whole)), SOURCE, 20, [])
    assert (found.y, found.height) == (pytest.approx(20, abs=4), pytest.approx(180, abs=4))


LEAVING = Box(-30, 20, 60, 160)


@pytest.mark.parametrize(
    ('tracked', 'lost', 'found'),
    [
        ([], [], True),
        ([], [LEAVING], False),
        ([LEAVING.shifted(-20, 0)], [], False),
        ([], [LEAVING.shifted(40, 0)], True),
        ([], [LEAVING.shifted(-90, 0)], True),
        ([], [Box(-30, 40, 60, 100)], True),
    ],
)
def test_nobody_is_what_is_left_of_somebody_who_leaves(tracked, lost, found):
    shown = heat(0, (12, 20, body((20, 45))))
    assert bool(sure(shown, SOURCE, 20, tracked, lost)) == found
