# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np

from benchmarks.kernels import tanimoto


def test_equal_is_one_disjoint_and_empty_are_zero():
    common = np.array([50, 0, 0, 20], np.int32)
    window = np.array([50, 30, 0, 60], np.int32)
    template = np.array([50, 20, 0, 40], np.int32)
    result = tanimoto(common, window, template)
    assert result.dtype == np.float32
    np.testing.assert_allclose(result, [1.0, 0.0, 0.0, 0.25])
