# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import cv2
import numpy as np
import pytest

from gait_segmentation.gait_model import default_bank
from gait_segmentation.geometry import Box
from gait_segmentation.heat_maps import HeatMap
from gait_segmentation.tracking.arrivals import MapFinder

SOURCE = (240, 320)


@pytest.fixture(scope='module')
def bank():
    return default_bank()


def body(bank, size=(30, 60), phase=0):
    """Return a template, (h, w) uint8."""
    template = bank.templates[0, phase]
    x, y, w, h = cv2.boundingRect(template)
    return np.where(cv2.resize(template[y : y + h, x : x + w], size) > 127, 255, 0)


def heat(number, *regions):
    """Return the map of a frame at half the size of the source, with regions (left, top, what)."""
    values = np.zeros((120, 160), np.uint8)
    for left, top, region in regions:
        values[top : top + region.shape[0], left : left + region.shape[1]] = region
    return HeatMap(values, 1 + number)


def test_people_are_found_at_once_by_the_shape_of_a_body(bank):
    finder = MapFinder(bank)
    regions = (20, 30, body(bank)), (90, 20, body(bank, (36, 80), 8))
    found = finder.update(heat(0, *regions), SOURCE, [], 20)
    assert [(box.x, box.y, box.width, box.height) for box in found] == [
        pytest.approx((180, 40, 72, 160), abs=4),
        pytest.approx((40, 60, 60, 120), abs=4),
    ]
    assert finder.update(heat(0, *regions), SOURCE, [], 20) == []


def test_whoever_is_tracked_is_not_found_again(bank):
    finder, region = MapFinder(bank), (20, 30, body(bank))
    assert finder.update(heat(0, region), SOURCE, [Box(36, 56, 70, 130)], 20) == []


def test_what_hangs_together_with_who_is_tracked_is_theirs(bank):
    finder, touching = MapFinder(bank), np.zeros((60, 64), np.uint8)
    touching[:, :30] = touching[:, 34:] = body(bank)
    touching[50:, 25:40] = 255
    assert finder.update(heat(0, (20, 30, touching)), SOURCE, [Box(36, 56, 66, 130)], 20) == []
    finder.reset()
    touching[:, 30:34] = 0
    assert len(finder.update(heat(1, (20, 30, touching)), SOURCE, [Box(36, 56, 66, 130)], 20)) == 1


@pytest.mark.parametrize('size', [(60, 30), (100, 8), (6, 12)])
def test_what_lies_or_is_tiny_is_nobody(bank, size):
    finder, region = MapFinder(bank), (20, 30, np.full(size[::-1], 255, np.uint8))
    assert not any(finder.update(heat(n, region), SOURCE, [], 30) for n in range(20))


def test_in_a_map_of_one_pixel_is_nobody(bank):
    one_pixel = HeatMap(np.full((1, 1), 255, np.uint8), 1)
    assert MapFinder(bank).update(one_pixel, (60, 60), [], 20) == []


def test_what_is_less_clear_must_be_seen_in_several_maps(bank):
    finder, square = MapFinder(bank), np.full((60, 34), 255, np.uint8)
    found = [len(finder.update(heat(n, (20 + n, 30, square)), SOURCE, [], 20)) for n in range(8)]
    assert found[0] == 0
    assert sum(found) >= 1
    finder.reset()
    jumping = [(20 + 70 * (n % 2), 30, square) for n in range(8)]
    assert not any(finder.update(heat(n, each), SOURCE, [], 20) for n, each in enumerate(jumping))


def test_a_part_that_the_network_is_sure_of_is_nobody_beside_the_whole(bank):
    finder, whole = MapFinder(bank), body(bank, (40, 90)) // 4
    whole[50:, 12:28] = 255
    (found,) = finder.update(heat(0, (20, 10, whole)), SOURCE, [], 20)
    assert (found.y, found.height) == (pytest.approx(20, abs=4), pytest.approx(180, abs=4))


def test_people_who_touch_faintly_are_two(bank):
    finder = MapFinder(bank)
    values = np.zeros((80, 90), np.uint8)
    values[30:40] = 60
    for left in (5, 55):
        values[:, left : left + 30] = np.maximum(values[:, left : left + 30], body(bank, (30, 80)))
    assert len(finder.update(heat(0, (20, 20, values)), SOURCE, [], 20)) == 2


def test_nobody_is_found_before_a_taller_one_who_is_not_sure_yet(bank):
    finder = MapFinder(bank)
    regions = (20, 30, body(bank)), (90, 20, np.full((80, 45), 255, np.uint8))
    found = [finder.update(heat(n, *regions), SOURCE, [], 20) for n in range(6)]
    first = next(boxes for boxes in found if boxes)
    assert found[0] == []
    assert [box.height for box in first] == pytest.approx([160, 120], abs=4)
