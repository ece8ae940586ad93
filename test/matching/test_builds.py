# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np

from benchmarks.kernels import ReferenceKernel
from gait_segmentation.matching.builds import BuildKernels
from gait_segmentation.matching.tanimoto import WindowGrid, polyphase


def test_each_build_has_its_rows_among_those_of_all():
    rng = np.random.default_rng(0)
    templates = rng.integers(0, 256, (3, 2, 5, 4), dtype=np.uint8)
    templates[2, 1] = templates[0, 0]
    grid = WindowGrid(5, 4, 2, 3)
    images = rng.integers(0, 256, (2, *grid.image_shape), dtype=np.uint8)
    kernels = BuildKernels(templates, np.array([1, 0, 1]), grid)
    assert kernels.rows == 5
    assert (kernels.part(0), kernels.part(1)) == (slice(0, 2), slice(2, 5))
    expected = ReferenceKernel(templates.reshape(-1, 5, 4), grid).common_area(images)
    out = kernels.new_rows(12)
    found = np.empty((kernels.rows, out.shape[1]), np.int32)
    for build in (1, 0):
        planes = polyphase(images, grid)
        found[kernels.part(build)] = kernels.common_rows(planes, build, (0, 0), (2, 2, 3), out)
    found = found[kernels.row.reshape(-1), :12]
    np.testing.assert_array_equal(found, expected.reshape(6, 12))
