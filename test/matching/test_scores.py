# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from gait_segmentation.matching.scores import FLOOR, Scores, ScoreStore

ALL = slice(0, 3)


def store(rows=4):
    made = ScoreStore(rows, 2, 3, 5)
    made.rows[:] = 7
    return made


def test_gives_each_searched_sequence_a_row_of_its_own():
    rows = store()
    first = rows.take(np.array([True, False, True]), ALL)
    second = rows.take(np.array([False, True, False]), ALL)
    taken = [first[0], first[2], second[1]]
    assert first[1] == second[0] == second[2] == -1
    assert len(set(taken)) == 3
    assert min(taken) >= 0
    assert rows.used == 3


@pytest.mark.parametrize('searched', [slice(0, 1), slice(1, 3), ALL])
def test_heights_that_are_not_searched_are_at_the_floor_however_often_rows_are_used(searched):
    rows = store()
    everything = np.ones(3, np.bool_)
    for between in (ALL, slice(0, 2), slice(2, 3)):
        for part in (between, searched):
            where = rows.take(everything, part)
            scores = rows.rows[where].reshape(3, 2, 3, 5)
            left_out = [height for height in range(3) if height not in range(3)[part]]
            assert (scores[:, :, left_out] == FLOOR).all()
            rows.rows.reshape(-1, 2, 3, 5)[where, :, part] = 9
            rows.give_back(where)
    assert rows.used == 0


def test_rows_given_back_are_used_again():
    rows = store(2)
    for _ in range(10):
        rows.give_back(rows.take(np.array([True, True]), ALL))
    assert len(rows.rows) == 2


def test_grows_and_keeps_what_is_there():
    rows = store(2)
    first = rows.take(np.array([True, True]), ALL)
    rows.rows[first] = 3
    second = rows.take(np.array([True, True, True]), slice(1, 2))
    assert not set(first) & set(second)
    assert (rows.rows[first] == 3).all()
    assert (rows.rows[second].reshape(3, 2, 3, 5)[:, :, [0, 2]] == FLOOR).all()
    assert rows.used == 5


def test_scores_of_what_was_not_searched_are_at_the_floor():
    values = np.arange(2 * 2 * 3, dtype=np.int16).reshape(2, 2, 3)
    found = Scores(values, np.array([1, -1, 0], np.int32))
    assert found.of(0, 1).tolist() == values[1, 1].tolist()
    assert found.at(0, 1, 2) == values[1, 1, 2]
    assert found.at(1, 1, 2) == FLOOR
    assert found.at(2, 1, 2) == values[0, 1, 2]
