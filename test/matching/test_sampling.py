# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from gait_segmentation.matching.sampling import antialiasing_side, inside, region, smoothed


@pytest.mark.parametrize(('pitch', 'side'), [(0.01, 1), (1.0, 1), (1.5, 1), (2.0, 3), (4.0, 5)])
def test_the_filter_is_odd_and_about_as_wide_as_the_samples_are_apart(pitch, side):
    assert antialiasing_side(pitch) == side


def test_inside_is_inside_of_all_sides():
    assert inside((0, 0, 30, 20), (20, 30))
    assert inside((1, 1, 29, 19), (20, 30), 1)
    for sides in ((-1, 0, 30, 20), (0, -1, 30, 20), (0, 0, 31, 20), (0, 0, 30, 21)):
        assert not inside(sides, (20, 30))


def test_a_part_is_smoothed_as_the_whole():
    rng = np.random.default_rng(0)
    image = rng.integers(0, 256, (60, 80), dtype=np.uint8)
    known = np.where(rng.random(image.shape) < 0.6, 255, 0).astype(np.uint8)
    every = slice(0, 60), slice(0, 80)
    for mask in (None, known):
        whole, _ = smoothed(image, mask, every, 9)
        window = region((20.2, 15.5, 50.0, 40.1), image.shape, 9)
        part, _ = smoothed(image, mask, window, 9)
        rows, columns = slice(15, 41), slice(20, 50)
        inner = part[15 - window[0].start :, 20 - window[1].start :][:26, :30]
        np.testing.assert_array_equal(inner, whole[rows, columns])
