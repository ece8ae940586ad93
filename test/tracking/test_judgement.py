# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from gait_segmentation.tracking.judgement import beyond


def test_strangers_are_expected_beside_the_person_and_all_of_them_out_of_reach() -> None:
    near = np.array([20.0, 0.0, -3.0, -6.0, -12.0, -40.0], np.float32)
    assert beyond(near, 100.0) == pytest.approx([0, 0, 0.25, 0.5, 1, 1])
