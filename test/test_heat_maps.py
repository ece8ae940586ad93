# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import cv2
import numpy as np
import pytest

from gait_segmentation.errors import InputError
from gait_segmentation.geometry import Box
from gait_segmentation.heat_maps import (
    HeatMap,
    HeatMaps,
    MapTrust,
    alignment,
    heat_map_of,
    own_regions,
    regions,
)
from test.walkers import clip


@pytest.mark.parametrize(
    'array',
    [
        np.array([[0, 51, 255]], np.uint8),
        np.array([[0, 51 << 8 | 200, 65535]], np.uint16),
        np.array([[0, 0.2, 1]], np.float32),
        np.array([[0, 0.2, 1]], np.float64),
        np.repeat(np.array([[0, 51, 255]], np.uint8)[..., None], 3, axis=2),
        np.array([[[0, 0, 0, 9], [51, 51, 51, 0], [255, 255, 255, 255]]], np.uint8),
    ],
)
def test_every_kind_of_map_comes_out_alike(array):
    heat = heat_map_of(array)
    assert heat.dtype == np.uint8
    assert heat.tolist() == [[0, 51, 255]]


@pytest.mark.parametrize(
    ('array', 'message'),
    [
        ([[1]], 'must be an array, got list'),
        (np.zeros((0, 4), np.uint8), r'with pixels, got \(0, 4\)'),
        (np.zeros((2, 2, 2), np.uint8), r'got \(2, 2, 2\)'),
        (np.zeros((2, 2), np.int32), 'uint8, uint16 or floats, got int32'),
        (np.array([[0, np.nan]]), 'got NaN or infinity'),
        (np.array([[0, 255]], np.float32), 'must be from 0 to 1, got 0 to 255'),
        (np.array([[[1, 2, 3]]], np.uint8), 'must be grey'),
    ],
)
def test_what_is_no_map_is_refused(array, message):
    with pytest.raises(InputError, match=message):
        heat_map_of(array)


FRAME = np.zeros((4, 4, 3), np.uint8)


def one(value: int) -> np.ndarray:
    return np.full((2, 2), value, np.uint8)


def test_the_newest_map_up_to_a_frame_counts_if_it_is_not_too_old():
    maps = HeatMaps()
    for value, stamp_ns in ((1, 10), (3, 30), (2, 20)):
        maps.add(one(value), stamp_ns)
    asked = {stamp: maps.newest(FRAME, stamp, 25e-9) for stamp in (9, 10, 29, 30, 55, 56)}
    values = {stamp: None if each is None else each.values[0, 0] for stamp, each in asked.items()}
    assert values == {9: None, 10: 1, 29: 2, 30: 3, 55: 3, 56: None}
    assert maps.newest(FRAME, 31, 0) is None
    # A map may be changed after it was given.
    heat = one(7)
    maps.add(heat, 1)
    heat[:] = 9
    found = maps.newest(FRAME, 1, 0)
    assert found.values[0, 0] == 7


MASK = clip()[0].masks[0]
NOISE = np.random.default_rng(0).integers(0, 256, MASK.shape, np.uint8)
MAPS = {
    'right': MASK,
    'half the size': MASK[::2, ::2],
    'soft': cv2.GaussianBlur(MASK, (9, 9), 0),
    'mirrored': MASK[:, ::-1],
    'shifted': np.roll(MASK, 8, axis=1),
    'of another frame': clip()[15].masks[0],
    'inverted': 255 - MASK,
    'full': np.full_like(MASK, 255),
    'empty': np.zeros_like(MASK),
    'noise': NOISE,
}


@pytest.mark.parametrize('kind', MAPS)
def test_a_map_is_trusted_if_its_outline_lies_on_edges_of_the_image(kind):
    heat = HeatMap(np.ascontiguousarray(MAPS[kind]), clip()[0].stamp_ns)
    trust = MapTrust().update(clip()[0].image, clip()[0].stamp_ns, heat)
    assert trust == (kind in ('right', 'half the size', 'soft'))


def test_trust_comes_and_goes_over_some_maps_whatever_their_lag():
    kept, found = MapTrust(), []
    for number in range(60):
        frame, late = (clip()[min(max(at, 0), 15)] for at in (number, number - 8))
        values = late.masks[0] if number < 20 else NOISE
        stamps = 40_000_000 * (number + 9), 40_000_000 * (max(number - 8, 0) + 9)
        found.append(kept.update(frame.image, stamps[0], HeatMap(values, stamps[1])))
        if number == 20:
            # Each map counts once.
            for _ in range(30):
                kept.update(frame.image, stamps[0], HeatMap(values, stamps[1]))
    assert found[:22] == [1] * 22
    assert found[-1] == 0 < min(each for each in found if each) < 1


@pytest.mark.parametrize('late', [0, 8, 14])
def test_a_map_is_compared_with_its_own_frame(late):
    kept, frames = MapTrust(), clip()[:16]
    for frame in frames:
        # Of maps without an outline there is nothing to trust.
        kept.update(frame.image, frame.stamp_ns, HeatMap(MAPS['empty'], frames[0].stamp_ns))
    now, then = frames[-1], frames[-1 - late]
    heat = HeatMap(then.masks[0], then.stamp_ns)
    assert kept.update(now.image, now.stamp_ns + 1, heat) == 1


def test_the_alignment_is_that_of_slopes_in_any_direction_unless_there_is_an_outline():
    image = clip()[0].image
    lab = cv2.cvtColor(image, cv2.COLOR_BGR2Lab)
    assert alignment(NOISE, lab) == pytest.approx(2 / np.pi, abs=0.05)
    assert alignment(MASK, lab) > 1.4
    assert alignment(MAPS['empty'], lab) is None


def test_the_regions_of_a_map_are_those_above_one_half_and_others_can_be_left_out():
    values = np.full((20, 40), 127, np.uint8)
    values[2:12, 3:7] = 128
    values[5:9, 20:35] = 255
    assert sorted(regions(values), key=lambda each: each[1]) == [
        (Box(3, 2, 4, 10), 40),
        (Box(20, 5, 15, 4), 60),
    ]
    expected = np.zeros_like(values)
    # A tenth of the larger region, or of the person if they are smaller.
    expected[5:9, 34:40] = 128
    alone = own_regions(values, expected)
    assert (alone[5:9, 20:35] == 255).all()
    assert not alone[2:12, 3:7].any()
    assert (alone[values == 127] == 127).all()
    expected[:] = 0
    expected[5:7, 34:40] = 255
    expected[12:18, :] = 255
    assert own_regions(values, expected).max() == 127
    # Of a crowd that hangs together somebody may be a small part.
    crowd = np.full((40, 40), 255, np.uint8)
    small = np.zeros_like(crowd)
    small[10:20, 10:14] = 255
    assert own_regions(crowd, small).all()
