# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np

from gait_segmentation.matching.scores import FLOOR, Scores, ScoreStore
from gait_segmentation.matching.search_range import SearchRange
from gait_segmentation.matching.tanimoto import pitch_of


def store(rows=4):
    made = ScoreStore(rows, 30)
    made.rows[:] = 7
    return made


def test_gives_each_searched_sequence_a_row_of_its_own():
    rows = store()
    first = rows.take(np.array([True, False, True]))
    second = rows.take(np.array([False, True, False]))
    taken = [first[0], first[2], second[1]]
    assert first[1] == second[0] == second[2] == -1
    assert len(set(taken)) == 3
    assert min(taken) >= 0
    assert rows.used == 3


def test_rows_given_back_are_used_again():
    rows = store(2)
    for _ in range(10):
        rows.give_back(rows.take(np.array([True, True])))
    assert len(rows.rows) == 2


def test_grows_and_keeps_what_is_there():
    rows = store(2)
    first = rows.take(np.array([True, True]))
    rows.rows[first] = 3
    second = rows.take(np.array([True, True, True]))
    assert not set(first) & set(second)
    assert (rows.rows[first] == 3).all()
    assert rows.used == 5


def test_scores_of_what_was_not_searched_are_at_the_floor():
    searched = SearchRange((1, 0, 2), (1, 2, 2))
    pitch = pitch_of(4)
    values = np.arange(2 * 3 * pitch, dtype=np.int16).reshape(2, 3 * pitch)
    found = Scores(values, np.array([1, -1, 0], np.int32), searched)
    assert found.of(0, 1).tolist() == values[1, pitch : pitch + 4].tolist()
    assert found.at(0, 1, (1, 1, 2)) == values[1, pitch + 2]
    assert found.at(1, 1, (1, 1, 2)) == FLOOR
    assert found.at(2, 2, (1, 0, 3)) == values[0, 2 * pitch + 1]
    for place in ((0, 0, 2), (2, 0, 2), (1, -1, 2), (1, 2, 2), (1, 0, 1), (1, 0, 4)):
        assert found.at(0, 1, place) == FLOOR
