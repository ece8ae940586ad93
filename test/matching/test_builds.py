# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np

from gait_segmentation.gait_model import TemplateBank
from gait_segmentation.matching import MatchingConfig
from gait_segmentation.matching.builds import BuildChoice, BuildKernels
from gait_segmentation.matching.tanimoto import ReferenceKernel, WindowGrid, polyphase


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


def test_trials_that_agree_become_rarer_until_one_does_not():
    builds = choice(build_trial=0.5, build_rest=1.0)
    first, second = (np.array([[5, 0], [a, 0], [3, 0]], np.int16) for a in (0, 7))
    trials = []
    for k in range(400):
        seconds = 0.125 * k
        if builds.choose(seconds, first if seconds < 38 else second).all():
            trials.append(seconds)
    begins = [t for t in trials if t - 0.125 not in trials]
    assert np.diff(begins).tolist() == [1.5, 2.5, 4.5, 8.5, 8.5, 8.5, 8.5, 1.5, 2.5]


def test_without_rest_all_are_searched():
    builds = choice(build_rest=0.0)
    assert all(builds.choose(0.5 * k, np.zeros((3, 2), np.int16)).all() for k in range(20))


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
    out = kernels.new_rows()
    for image, plane in enumerate(polyphase(images, grid)):
        found = np.empty((kernels.rows, kernels.pitch), np.int32)
        for build in (1, 0):
            found[kernels.part(build)] = kernels.common_rows(plane, build, out)
        found = found[kernels.row.reshape(-1), :6]
        np.testing.assert_array_equal(found, expected[:, image].reshape(6, 6))
