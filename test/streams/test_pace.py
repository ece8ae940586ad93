# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import pytest

from gait_segmentation.streams.pace import Pace


def paces(loads, every_s=0.25):
    pace = Pace()
    return [pace.update(load, 10 + every_s * number) for number, load in enumerate(loads)]


def test_it_begins_in_the_middle_and_goes_on_to_all_while_there_is_time():
    assert paces([0.0] * 4)[::2] == [0.5, 1.0]
    assert set(paces([0.0, 0.5] * 20)[2:]) == {1.0}


def test_it_is_halved_twice_a_second_while_there_is_too_much_and_not_for_ever():
    found = paces([0.0] * 3 + [1.5] * 40)
    assert found[2:8] == [1.0, 1.0, 0.5, 0.5, 0.25, 0.25]
    assert min(found) == 0.25


@pytest.mark.parametrize(('load', 'last'), [(0.85, 0.25), (0.5, 1.0)])
def test_it_comes_back_only_when_there_is_time_again(load, last):
    assert paces([1.5] * 3 + [load] * 20)[-1] == last
