# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from gait_segmentation.geometry import Box
from gait_tools.evaluation.attendance import Attendance, Sighting


def attendance(columns_of, frames=20, fps=5.0):
    """Draw people as columns x to x + width of an image of 60 x 40."""

    def labels(number):
        drawn = np.zeros((40, 60), np.uint8)
        for person, columns in columns_of(number).items():
            drawn[5:35, columns] = person
        return drawn

    return Attendance(((n, labels(n)) for n in range(frames)), fps, (60, 40))


def coming(number):
    """One comes in from the left by two columns a frame; two stands from frame 4 on."""
    return {1: slice(max(2 * number - 10, 0), max(2 * number, 0))} | (
        {2: slice(40, 50)} if number >= 4 else {}
    )


def test_sightings_are_boxes_and_areas():
    seen = attendance(coming)
    assert seen.people == (1, 2)
    assert seen.sighting(1, 0) is None
    assert seen.sighting(1, 3) == Sighting(Box(0, 5, 6, 30), 180)
    assert set(seen.sightings(5)) == {1, 2}
    assert seen.sighting(9, 5) is None


def test_who_touches_the_border_is_not_whole():
    seen = attendance(coming)
    assert seen.first_whole(1) == 6
    assert seen.first_whole(2) == 4
    at_border = attendance(lambda number: {1: slice(0, 10)})
    assert at_border.first_whole(1) == 0


def test_little_of_somebody_is_not_seeing_them():
    # A second is five frames: what is seen at 1 is next to nothing of what is seen at 5.
    seen = attendance(lambda number: {1: slice(20, 21 if number < 3 else 32)})
    assert seen.seen(1)[0] == 3
    partly = attendance(lambda number: {1: slice(20, 26 if number < 3 else 32)})
    assert partly.seen(1)[0] == 0
    assert partly.first_whole(1) == 3


def test_who_was_hidden_returns():
    seen = attendance(lambda number: {} if 7 <= number < 12 else {1: slice(20, 30)})
    assert seen.returns(1) == [12]
    assert attendance(coming).returns(2) == []


def test_boxes_belong_to_people():
    seen = attendance(coming)
    assert seen.person_at(Box(39, 4, 12, 32), 6) == 2
    assert seen.person_at(Box(20, 4, 12, 32), 6) is None
    assert seen.person_at(Box(39, 4, 12, 32), 99) is None


def test_nobody():
    empty = attendance(lambda number: {})
    assert empty.people == ()
    assert empty.numbers == list(range(20))
    with pytest.raises(KeyError):
        empty.seen(1)
