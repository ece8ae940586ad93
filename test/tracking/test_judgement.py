# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest

from gait_segmentation.ego_motion.world_motion import WorldMotion
from gait_segmentation.geometry import BodyFrame, Box
from gait_segmentation.results import Feedback
from gait_segmentation.tracking import TrackingConfig
from gait_segmentation.tracking.judgement import _motions, _take_back_uncovered, add_motion
from gait_segmentation.tracking.person.person import Person, new_colours
from gait_segmentation.tracking.world import World
from gait_segmentation.warping import warp_window
from test.tracking.figures import HEIGHT, STEP_NS, WIDTH, Figure, Told, walk, wall

BOARD = (42, 42, 205)
"""Colour of an even board behind the person: that of the coat."""

GHOST = 14
"""Width of the piece of board in the first masks, behind the back."""


def ghost_after(
    frames: int, speed: float, *, held: bool = True, **tracking
) -> tuple[float, float]:
    """
    Return how likely board is that was in the first masks, and how likely the person.

    It is even and has the colour of the coat, so that only what is at its rim tells of it.
    ``held`` is whether it is in the masks that come back, too.
    """
    told = Told(**tracking)
    rng = np.random.default_rng(5)
    figures = walk(Figure(90), frames, speed)
    told.start(figures[0])
    back = np.zeros((HEIGHT, WIDTH), np.uint8)
    body = Box.around(figures[0].mask())
    assert body is not None
    rows, left = slice(60, 95), round(body.x)
    back[rows, left - GHOST : left + 12] = 255
    ghost = cv2.subtract(back, cv2.dilate(figures[-1].mask(), np.ones((5, 5), np.uint8))) > 0
    for number, figure in enumerate(figures):
        image = np.full((HEIGHT, WIDTH, 3), (120, 130, 125), np.uint8)
        image[rows, :100] = BOARD
        figure.draw(image)
        noisy = np.clip(image + rng.integers(-2, 3, image.shape), 0, 255).astype(np.uint8)
        result = told.tracker.update(noisy, (number + 1) * STEP_NS)[0]
        own = figure.mask()
        box = Box.around(own)
        assert box is not None
        place = BodyFrame(box.center_x, box.center_y, box.height)
        size = result.likelihood.shape[::-1]
        prior = cv2.resize(own, size, interpolation=cv2.INTER_AREA)
        mask = cv2.bitwise_or(own, back) if held else own
        told.tracker.learn([Feedback(result.stamp_ns, result.track_id, mask, place, prior)])
    likelihood = cv2.resize(result.likelihood, (WIDTH, HEIGHT))
    return float(likelihood[ghost].mean()), float(likelihood[own > 0].mean())


def test_an_even_board_that_the_first_masks_hold_is_doubted_by_what_is_about_it() -> None:
    with_spread, person = ghost_after(5, 3)
    without, person_without = ghost_after(5, 3, spread_weight=0.0)
    assert with_spread < without - 30
    assert person > person_without - 5


def test_of_somebody_who_stands_nothing_is_doubted() -> None:
    without = ghost_after(3, 0, held=False, spread_weight=0.0)
    assert ghost_after(3, 0, held=False) == without
    assert ghost_after(3, 3, held=False) != ghost_after(3, 3, held=False, spread_weight=0.0)


@pytest.mark.parametrize(('step', 'moves'), [(1.0, True), (0.1, False)])
def test_of_who_hardly_moves_motion_tells_nothing(step: float, moves: bool) -> None:
    config = TrackingConfig()
    world = World.for_person((HEIGHT, WIDTH), 100.0, config)
    nowhere = np.zeros((HEIGHT, WIDTH), np.uint8)
    person = Person(1, 150.0, 90.0, 100.0, 15.0, 15.0, nowhere, *new_colours(config))
    for number in range(6):
        world.advance(wall(), (number + 1) * STEP_NS, (), camera=False)
        world.now.bodies[1] = (step, 0.0)
    found = _motions(person, world)
    assert (found is not None) == moves
    assert found is None or found[0] is world.history[-5]


def taken_back(*, seen: float = 0.0) -> np.ndarray:
    """
    Return the evidence that pixels move with a body that has gone from the left to the right.

    :param seen: how often the background was seen.
    """
    there, along = (np.zeros((4, 60), np.uint8) for _ in range(2))
    there[:, 20:30], along[:, 30:40] = 255, 255
    moving = np.full((4, 60), 2, np.float32)
    moving[:, :20] = 0
    return _take_back_uncovered(there, along, np.full((4, 60), seen < 0.5), moving)


def test_what_the_body_uncovers_does_not_move_with_it() -> None:
    assert taken_back()[:, 20:30].max() < 0
    assert taken_back()[:, 30:].min() == 2


def test_what_is_before_a_known_wall_may_move() -> None:
    assert taken_back(seen=1)[:, 20:30].min() == 2


WINDOW = (slice(10, 70), slice(10, 90))


def shift(dx: float, dy: float = 0.0) -> np.ndarray:
    return np.array([[1.0, 0.0, dx], [0.0, 1.0, dy]])


def test_what_moves_with_the_body_is_person_and_what_stays_is_not() -> None:
    rng = np.random.default_rng(0)
    world = rng.integers(0, 255, (80, 100)).astype(np.uint8)
    cloth = rng.integers(0, 255, (80, 100)).astype(np.uint8)
    person = np.zeros((80, 100), np.bool_)
    person[20:60, 30:50] = True
    earlier = np.where(person, cloth, world)
    now = np.where(np.roll(person, 10, 1), np.roll(cloth, 10, 1), world)
    logit = np.zeros((60, 80), np.float32)
    add_motion(logit, now, earlier, WorldMotion(), shift(10), WINDOW, 1.0)
    assert logit[25, 38] == pytest.approx(2)
    assert logit[25, 70] == pytest.approx(-2)
    assert np.abs(logit).max() <= 2


@pytest.mark.parametrize(
    'window',
    [(slice(5, 40), slice(8, 60)), (slice(0, 60), slice(0, 80)), (slice(7, 8), slice(9, 11))],
)
def test_the_evidence_is_the_difference_of_what_the_two_motions_leave(
    window: tuple[slice, slice],
) -> None:
    rng = np.random.default_rng(9)
    then, now = (
        cv2.GaussianBlur(rng.integers(0, 256, (60, 80), np.uint8), (0, 0), 2) for _ in range(2)
    )
    camera = np.array([[1.001, 0.002, 1.3], [-0.002, 1.001, -0.4]])
    body = np.array([[1.0, 0.0, 3.5], [0.0, 1.0, 0.25]])
    logit = rng.normal(0, 1, now[window].shape).astype(np.float32)
    before = logit.copy()
    evidence = add_motion(logit, now, then, WorldMotion(camera), body, window, 0.6)
    stays, moves = (
        cv2.blur(cv2.absdiff(now[window], warp_window(then, each, window)), (3, 3)).astype(float)
        for each in (camera, body)
    )
    expected = np.clip((stays**2 - moves**2) / (2 * 12.0**2), -2, 2)
    np.testing.assert_allclose(evidence, expected, atol=1e-5)
    np.testing.assert_allclose(logit, before + 0.6 * expected, atol=1e-5)
