# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
from hypothesis import given, settings

from benchmarks.kernels import DirectAccessTableKernel, ReferenceKernel
from test.matching.tanimoto.cases import banks


@settings(max_examples=60)
@given(banks())
def test_equals_the_reference(case):
    templates, images, grid = case
    expected = ReferenceKernel(templates, grid).common_area(images)
    np.testing.assert_array_equal(
        DirectAccessTableKernel(templates, grid).common_area(images), expected
    )
