# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np

from gait_segmentation.matching.scores import FLOOR
from gait_segmentation.matching.search_range import SearchRange
from gait_segmentation.matching.trellis import Trellis

RANGE = SearchRange((0, 0, 0), (1, 1, 3))
BOTH = np.ones(2, np.bool_)
COSTS = np.zeros(2, np.int16)


def trellis(frames=3):
    made = Trellis(sequences=2, phases=4, together=2, shape=(1, 1, 3), least_frames=frames)
    for k in range(frames):
        made.rows[made.add(BOTH, 0.1 * k, COSTS, (0, 0, 0), RANGE)] = k
    return made


def test_frames_are_counted_back_from_the_newest():
    made = trellis()
    assert (len(made), made.seconds) == (3, [0.0, 0.1, 0.2])
    assert [int(made.scores(back).at(1, 2, (0, 0, 1))) for back in range(3)] == [2, 1, 0]
    made.drop_oldest()
    assert (len(made), made.seconds, made.used) == (2, [0.1, 0.2], 4)
    made.clear()
    assert (len(made), made.used) == (0, 0)
    assert (made.where() == -1).all()


def test_there_is_room_for_the_least_number_of_frames():
    assert trellis(100).capacity == 100


def test_scores_move_with_the_body_and_come_from_the_floor_beyond_the_range():
    made = trellis()
    assert made.moved(RANGE, (0, 0, 0)) is None
    made.rows[made.where(), :3] = 5, 6, 7
    moved = made.moved(RANGE, (0, 0, 1))
    assert made.rows[moved, :3].tolist() == 2 * [[6, 7, FLOOR]]
    made.give_back(moved)
    assert made.used == 6


def test_the_best_path_is_traced_back_from_a_state():
    made = trellis()
    near, near_cost = np.full((2, 1), -1, np.int32), np.zeros((2, 1), np.int16)
    path = made.trace((1, 2, 0, 0, 1), near, near_cost, 1, np.empty((0, 5), np.int64))
    assert path.tolist() == 3 * [[1, 2, 0, 0, 1]]
