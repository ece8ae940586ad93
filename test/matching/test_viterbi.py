# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import itertools

import numpy as np

from gait_segmentation.matching.transitions import UNIT
from gait_segmentation.matching.viterbi import FLOOR, advance, shifted, trace

SHAPE = (2, 2, 3)
LANES = 8


def frame(rng, templates, rows, seen=False):
    common = rng.integers(0, 1000, (2, rows, LANES)).astype(np.int32)
    window = rng.integers(1000, 2000, 2 * LANES).astype(np.int32)
    area = rng.integers(1000, 2000, templates).astype(np.int32)
    visible = rng.integers(1000, 2000, (2 if seen else 0, rows, LANES)).astype(np.int32)
    return common, window, area, visible


def places():
    return list(itertools.product(*(range(n) for n in SHAPE)))


def lane(place):
    return place[0] * LANES + place[1] * SHAPE[2] + place[2]


def similarity(data, row, k, place):
    common, window, area, visible = data
    c = int(common[place[0], row, lane(place) % LANES])
    g = int(visible[place[0], row, lane(place) % LANES]) if len(visible) else int(area[k])
    share = np.float32(c) / np.float32(int(window[lane(place)]) + g - c)
    return int(share * np.float32(UNIT) + np.float32(0.5))


def run(before, best, data, costs, near, near_cost, row):
    after = np.zeros((2, 3, 2 * LANES), np.int16)
    leading = np.zeros((2, 3), np.int16)
    fading, free = np.int32(32768 * 0.9), np.zeros(2 * LANES, np.int16)
    every = np.ones(2, np.bool_)
    layout = np.int16(20), SHAPE, data[0], row, data[1], data[2], data[3]
    reach = fading, costs, near, near_cost, every, every
    advance(before, np.int32(best), *reach, *layout, 0.1, free, after, leading)
    return after, leading


def test_equals_brute_force():
    rng = np.random.default_rng(0)
    near, near_cost = np.array([[1], [0]], np.int32), np.array([[70], [90]], np.int16)
    costs = np.array([30, 0], np.int16)
    row = np.array([0, 1, 2, 3, 4, 0], np.int32)
    scores = np.zeros((0, 3, 2 * LANES), np.int16)
    ring, best = [], 0
    for number in range(4):
        data = frame(rng, 6, 5, seen=number % 2 == 1)
        after, leading = run(scores, best, data, costs, near, near_cost, row)
        for view, phase, place in itertools.product(range(2), range(3), places()):
            own = similarity(data, row[view * 3 + phase], view * 3 + phase, place)
            if number:
                reached = max(
                    int(scores[v, (phase - step) % 3, lane(p)])
                    - int(costs[step])
                    - (0 if v == view else int(near_cost[view, 0]))
                    - 20 * sum(abs(a - b) for a, b in zip(p, place, strict=True))
                    for v in range(2)
                    for step in range(2)
                    for p in places()
                    if max(abs(a - b) for a, b in zip(p, place, strict=True)) <= 1
                )
                own += max(reached - best, FLOOR) * int(32768 * 0.9) >> 15
            assert after[view, phase, lane(place)] == own
        assert leading.max() == max(after[..., lane(p)].max() for p in places())
        scores, best = after, int(leading.max())
        ring.append(after)
    slots = np.arange(4)
    path = np.zeros((4, 5), np.int64)
    view, phase = divmod(int(leading.argmax()), 3)
    path[-1] = view, phase, *max(places(), key=lambda p: after[view, phase, lane(p)])
    trace(np.array(ring), slots, np.tile(costs, (4, 1)), np.full(4, 2), np.zeros((4, 3), np.int64),
          near, near_cost, np.int64(20), SHAPE, path)  # fmt: skip
    steps = np.diff(path, axis=0)
    assert set((steps[:, 1] % 3).tolist()) <= {0, 1}
    assert np.abs(steps[:, 2:]).max() <= 1
    assert (path[:, 2:] >= 0).all()
    assert (path[:, 2:] < SHAPE).all()


def test_a_jump_moves_scores_and_opens_the_border():
    scores = np.arange(2 * LANES, dtype=np.int16).reshape(1, 1, -1)
    result = np.empty_like(scores)
    shifted(scores, SHAPE, np.array([0, 1, -1]), result)
    assert result[0, 0, lane((1, 0, 1))] == scores[0, 0, lane((1, 1, 0))]
    assert result[0, 0, lane((1, 1, 1))] == FLOOR
    assert result[0, 0, lane((0, 0, 0))] == FLOOR


def test_templates_out_of_sight_do_not_count():
    rng = np.random.default_rng(1)
    data = frame(rng, 6, 6, seen=True)
    data[3][:] = 5
    row = np.arange(6, dtype=np.int32)
    none = np.full((2, 0), -1, np.int32)
    start = np.zeros((0, 3, 2 * LANES), np.int16)
    after, _ = run(start, 0, data, np.zeros(1, np.int16), none, none.astype(np.int16), row)
    assert after.max() <= 1
