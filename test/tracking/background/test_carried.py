# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.ego_motion.world_motion import WorldMotion
from gait_segmentation.geometry import scaling
from gait_segmentation.images import Window
from gait_segmentation.tracking.background.carried import CarriedBackground
from gait_segmentation.tracking.background.model import BackgroundModel

SHAPE = (40, 60)
EVERY: list[Window] = [(slice(0, 40), slice(0, 60))]
STILL = WorldMotion()
NOBODY = np.zeros(SHAPE, np.uint8)


def right(pixels: float) -> WorldMotion:
    motion = scaling(1.0)
    motion[0, 2] = pixels
    return WorldMotion(motion)


def scene() -> np.ndarray:
    return np.random.default_rng(0).integers(0, 256, (*SHAPE, 3), dtype=np.uint8)


class Film:
    """Frames of a camera that pans by 2 pixels each, of which none has been taken."""

    def __init__(self, frames: int, step: WorldMotion) -> None:
        self.background = CarriedBackground(SHAPE)
        self.background.model.learn(scene(), NOBODY)
        self.steps: list[WorldMotion] = []
        self.ahead: list[BackgroundModel] = []
        for _ in range(frames):
            self.steps.append(step)
            self.ahead.append(self.background.ahead(self.steps, EVERY))

    def take(self, version: int = 0) -> None:
        step, ahead = self.steps.pop(0), self.ahead.pop(0)
        self.background.take(step, EVERY, ahead, version)


def test_a_newer_frame_is_reached_in_one_step() -> None:
    film = Film(3, right(2.0))
    np.testing.assert_allclose(film.ahead[2].mean[:, 6:], scene()[:, :-6], atol=1e-3)
    assert film.ahead[2].count[0, 10] == pytest.approx(0.98**3)
    np.testing.assert_array_equal(film.background.model.mean, scene())


def test_a_frame_that_is_taken_brings_its_own_background_along() -> None:
    film = Film(1, right(2.0))
    ahead = film.ahead[0]
    film.take()
    assert film.background.model is ahead


def test_what_was_learnt_meanwhile_is_kept() -> None:
    film = Film(2, right(2.0))
    film.take()
    model = film.background.model
    model.learn(np.full((*SHAPE, 3), 77, np.uint8), NOBODY)
    film.take()
    model = film.background.model
    # Seen twice, once in the frame before.
    assert model.count[20, 30] == pytest.approx(0.98 * (0.98 + 1))
    assert film.background.version == 2


def test_what_is_skipped_takes_the_background_along() -> None:
    film = Film(2, right(2.0))
    film.background.skip(film.steps[0], EVERY)
    np.testing.assert_allclose(film.background.model.mean[:, 2:], scene()[:, :-2], atol=1e-3)
    assert film.background.version == 0


@pytest.mark.parametrize('frames', [1, 3])
@pytest.mark.parametrize('step', [STILL, right(2.0)])
def test_what_is_forgotten_stays_so(frames: int, step: WorldMotion) -> None:
    film = Film(frames, step)
    where = NOBODY.copy()
    where[10:20, 15:35] = 255
    film.background.forget(where, film.ahead[-1], film.steps)
    assert (film.ahead[-1].count == 0)[where > 0].all()
    for _ in range(frames):
        film.take()
        assert (film.background.model.count[10:20, 21:35] == 0).all()
    assert film.background.model.count[25:, 21:35].min() > 0.9


def known() -> BackgroundModel:
    """Return what is known from elsewhere: a part of the scene, seen nine times."""
    model, hidden = BackgroundModel(SHAPE), np.ones(SHAPE, np.uint8)
    hidden[10:30, 20:40] = 0
    for _ in range(9):
        model.learn(scene(), hidden)
    model.sigma = 3.0
    return model


@pytest.mark.parametrize('frames', [1, 3])
def test_what_is_known_from_elsewhere_is_known_in_all_frames_from_then_on(frames: int) -> None:
    film = Film(frames, right(2.0))
    window = slice(10, 30), slice(20, 40)
    film.background.adopt(known(), film.ahead[-1], film.steps)
    assert film.ahead[-1].count[window] == pytest.approx(9.0)
    while film.steps:
        film.take()
    found = film.background.model
    # To the first frame and back again the border is lost.
    assert found.count[12:28, 22:38].min() > 7
    assert np.abs(found.mean[12:28, 22:38] - scene()[12:28, 22:38]).max() < 1


@pytest.mark.parametrize(('before', 'sigma'), [(True, 5.0), (False, 3.0)])
def test_the_spread_is_taken_over_where_nothing_was_known(before: bool, sigma: float) -> None:
    background = CarriedBackground(SHAPE)
    if before:
        background.model.learn(scene(), NOBODY)
    ahead = background.ahead([right(1.0)], EVERY)
    background.adopt(known(), ahead, [right(1.0)])
    assert (background.model.sigma, ahead.sigma) == (sigma, sigma)
