# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from gait_segmentation.geometry import Box
from gait_segmentation.matching import MatchingConfig
from gait_segmentation.matching.placements import PlacementGrid, Sampled
from gait_segmentation.matching.readout import Readout, WaitingFrame
from gait_segmentation.matching.views import views_of
from test.walkers import small_bank


def setting():
    bank = small_bank()
    grid = PlacementGrid(bank.grid, bank.fill, MatchingConfig())
    views = views_of(bank)
    templates = bank.templates.reshape(-1, *bank.grid)
    return bank, grid, Readout(bank, templates, grid, views)


def frame(images, known=None):
    box = Box(40.0, 20.0, 40.0, 100.0)
    return WaitingFrame(10**9, 0.0, 3, box, 0.0, 0.5, (80, 100), Sampled(images, known))


def result(readout, waiting, state, bank):
    belief = np.zeros(bank.phases)
    belief[state[1]] = 1.0
    return readout.result(waiting, state, [0.0] * 5, belief, 0.9)


def test_the_template_of_the_state_is_laid_where_it_stands():
    bank, grid, readout = setting()
    state = (1, 2, *grid.center)
    images = np.zeros((grid.shape[0], *grid.windows.image_shape), np.uint8)
    images[(state[2], *grid.windows.part(state[3], state[4]))] = bank.templates[1, 2]
    found = result(readout, frame(images), state, bank)
    assert (found.sequence, found.phase_index, found.track_id) == (1, 2, 3)
    assert found.similarity == 1.0
    assert found.phase_rate == 0.9
    assert found.body.height == pytest.approx(100.0)
    assert (found.body.center_x, found.body.center_y) == pytest.approx((60.0, 70.0))
    rows = np.flatnonzero((found.shape_prior > 127).any(axis=1))
    assert (rows[0], rows[-1]) == (pytest.approx(10, abs=2), pytest.approx(59, abs=2))


def test_only_known_pixels_are_compared():
    bank, grid, readout = setting()
    state = (0, 0, *grid.center)
    part = (state[2], *grid.windows.part(state[3], state[4]))
    images = np.zeros((grid.shape[0], *grid.windows.image_shape), np.uint8)
    known = np.full_like(images, 255)
    known[:, 60:] = 0
    images[part] = bank.templates[0, 0]
    images &= known
    assert result(readout, frame(images, known), state, bank).similarity == 1.0
    assert result(readout, frame(images), state, bank).similarity < 1.0


def test_without_a_likelihood_the_body_is_the_box():
    bank, grid, readout = setting()
    images = np.zeros((grid.shape[0], *grid.windows.image_shape), np.uint8)
    found = result(readout, frame(images), (0, 1, 0, 0, 0), bank)
    assert (found.placement.dx, found.placement.dy, found.placement.scale) == (0, 0, 1)
    assert (found.similarity, found.confidence) == (0, 0)
