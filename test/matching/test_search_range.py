# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import itertools

import numpy as np
import pytest

from gait_segmentation.matching.search_range import SearchRange

EVERY = SearchRange((0, 0, 0), (5, 7, 9))
SOME = SearchRange((1, 2, 0), (2, 3, 4))


def test_lanes_and_places_belong_together():
    places = [SOME.place(lane) for lane in range(SOME.size)]
    assert places == list(itertools.product((1, 2), (2, 3, 4), range(4)))
    assert [SOME.lane(*place) for place in places] == list(range(24))
    for place in ((0, 2, 0), (3, 2, 0), (1, 1, 0), (1, 5, 0), (1, 2, -1), (1, 2, 4)):
        assert SOME.lane(*place) is None


@pytest.mark.parametrize(
    ('place', 'reach', 'first', 'shape'),
    [
        ((2, 3, 4), (1, 2, 3), (1, 1, 1), (3, 5, 7)),
        ((0, 6, 8), (1, 2, 3), (0, 2, 2), (3, 5, 7)),
        ((-3, 9, 4), (1, 9, 4), (0, 0, 0), (3, 7, 9)),
    ],
)
def test_what_is_about_a_place_has_the_same_size_at_the_border(place, reach, first, shape):
    assert EVERY.about(place, reach) == (first, shape)


def test_a_part_holds_the_values_of_its_places():
    values = np.arange(2 * EVERY.size, dtype=np.int16).reshape(2, -1)
    part = EVERY.part(values, SOME)
    for lane in range(SOME.size):
        assert (part[:, lane] == values[:, EVERY.lane(*SOME.place(lane))]).all()
