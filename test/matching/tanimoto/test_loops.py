# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np

from gait_segmentation.matching.tanimoto.loops import LANES, RUN, gather, run_program


def test_one_event_changes_all_lanes():
    matrix = np.arange(LANES, dtype=np.uint8)
    out = np.zeros(3 * LANES, np.int32)
    out[LANES : 2 * LANES] = 1000
    source = np.zeros(2, np.uint16)
    lo, span = np.array([10, 0], np.uint8), np.array([50, 0], np.uint8)
    change = np.clip(np.arange(LANES) - 10, 0, 50)
    for middle, sign in ((1, 1), (0, -1)):
        bounds = np.array([(0, middle, 1)], np.int32)
        step = np.array([2], np.int32), np.array([1], np.int32)
        run_program(matrix, source, lo, span, bounds, *step, out, LANES, 0)
        np.testing.assert_array_equal(out[2 * LANES :], 1000 + sign * change)


def test_gathers_runs():
    plane = np.arange(100, dtype=np.uint8)
    matrix = np.zeros(3 * LANES, np.uint8)
    places, offsets = np.array([0, 11]), np.array([0, 20])
    gather(plane, np.array([0, 5]), places, offsets, matrix)
    np.testing.assert_array_equal(matrix[:11], plane[:11])
    np.testing.assert_array_equal(matrix[LANES + 11 : LANES + 11 + RUN], plane[25 : 25 + RUN])
