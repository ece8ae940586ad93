# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np

from gait_segmentation.gait_model import TemplateBank
from gait_segmentation.matching import MatchingConfig
from gait_segmentation.matching.builds import BuildChoice, BuildKernels
from gait_segmentation.matching.tanimoto import ReferenceKernel, WindowGrid


def choice(**parameters):
    bank = TemplateBank(
        np.zeros((3, 2, 4, 4), np.uint8), np.zeros(3, np.float32), ('b', 'a', 'b'), 0.9
    )
    return BuildChoice(bank, MatchingConfig(**parameters))


def test_searches_the_leading_build_between_trials():
    builds = choice(build_trial=0.5, build_rest=1.0)
    leading = np.array([[0, 1], [0, 0], [7, 0]], np.int16)
    found = [builds.choose(0.25 * k, leading).tolist() for k in range(9)]
    assert builds.of_sequence.tolist() == [1, 0, 1]
    assert found == [[True, True]] * 2 + [[False, True]] * 4 + [[True, True]] * 2 + [[False, True]]
    builds.reset()
    assert builds.choose(9.0, leading).all()


def test_without_rest_all_are_searched():
    builds = choice(build_rest=0.0)
    assert all(builds.choose(0.5 * k, np.zeros((3, 2), np.int16)).all() for k in range(20))


def test_kernels_fill_the_rows_of_active_builds_only():
    rng = np.random.default_rng(0)
    templates = rng.integers(0, 256, (3, 2, 5, 4), dtype=np.uint8)
    grid = WindowGrid(5, 4, 2, 3)
    images = rng.integers(0, 256, (2, *grid.image_shape), dtype=np.uint8)
    kernels = BuildKernels(templates, np.array([1, 0, 1]), grid)
    out = kernels.new_rows(2)
    kernels.common_rows(images, np.array([False, True]), out)
    assert not out[:, kernels.row[1]].any()
    kernels.common_rows(images, np.array([True, True]), out)
    expected = ReferenceKernel(templates.reshape(-1, 5, 4), grid).common_area(images)
    found = out[:, kernels.row.reshape(-1), :6].swapaxes(0, 1).reshape(expected.shape)
    np.testing.assert_array_equal(found, expected)
