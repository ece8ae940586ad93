# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests of the colours on both sides of an outline."""

import cv2
import numpy as np
import pytest

from gait_segmentation.segmentation.local_colours import add_odds, discriminant
from gait_segmentation.segmentation.refinement import refine

PERSON, GROUND = (90, 140, 120), (160, 118, 135)


def scene(edge: float = 48.0) -> np.ndarray:
    """Return (64, 96, 3) Lab colours: the person left of a column, which may lie in a pixel."""
    share = np.clip(edge - np.arange(96), 0, 1)[None, :, None]
    colours = share * np.array(PERSON) + (1 - share) * np.array(GROUND)
    return np.repeat(np.round(colours), 64, 0).astype(np.uint8)


def first_cut(edge: int = 24) -> np.ndarray:
    labels = np.zeros((32, 48), bool)
    labels[:, :edge] = True
    return labels


def small(image: np.ndarray) -> np.ndarray:
    return cv2.resize(image, (48, 32), interpolation=cv2.INTER_AREA)


def odds_of(image: np.ndarray, labels: np.ndarray) -> np.ndarray:
    rows, columns = (np.arange(size) // 2 for size in image.shape[:2])
    nearest = (rows[:, None] * labels.shape[1] + columns).ravel().astype(np.int32)
    odds = np.zeros(image.shape[0] * image.shape[1], np.float32)
    line = discriminant(small(image), labels, np.ones_like(labels))
    add_odds(image.reshape(-1, 3), line, nearest, 1.0, odds)
    return odds.reshape(image.shape[:2])


def test_colours_of_the_person_are_for_it_and_those_of_the_ground_against_it():
    odds = odds_of(scene(), first_cut())

    assert (odds[:, 42:48] > 1).all()
    assert (odds[:, 48:54] < -1).all()


def test_an_even_mixture_says_little():
    image = scene(48.5)

    odds = odds_of(image, first_cut())

    assert np.abs(odds[:, 48]).max() < 0.5


def test_nothing_is_said_where_only_one_side_is_near():
    odds = odds_of(scene(), first_cut())

    assert (odds[:, :30] == 0).all()
    assert (odds[:, 66:] == 0).all()


def test_alike_colours_say_nothing():
    image = np.full((64, 96, 3), 120, np.uint8)

    assert np.abs(odds_of(image, first_cut())).max() < 1e-3


def test_a_mask_with_only_one_side_says_nothing():
    for labels in (np.zeros((32, 48), bool), np.ones((32, 48), bool)):
        assert not discriminant(small(scene()), labels, np.ones_like(labels)).any()


@pytest.mark.parametrize('part', [False, True])
def test_it_is_that_of_the_neighbourhood_wherever_it_is_wanted(part):
    rng = np.random.default_rng(2)
    image = rng.integers(0, 256, (32, 48, 3)).astype(np.uint8)
    labels = np.zeros((32, 48), bool)
    labels[8:26, 12:30] = True
    wanted = rng.random((32, 48)) < 0.5
    if part:
        wanted[:9] = wanted[24:] = wanted[:, :10] = wanted[:, 30:] = False
    line = discriminant(image, labels, wanted)
    person, ground = np.zeros_like(labels), np.ones_like(labels)
    person[9:25, 13:29] = True
    ground[7:27, 11:31] = False
    for row, column in zip(*np.nonzero(wanted), strict=True):
        about = np.s_[max(row - 4, 0) : row + 5, max(column - 4, 0) : column + 5]
        one, two = (image[about][side[about]].astype(float) for side in (person, ground))
        expected = np.zeros(4)
        if min(len(one), len(two)) >= 0.02 * 81:
            slope = (one.mean(0) - two.mean(0)) / ((one.var(0) + two.var(0)) / 2 + 16)
            expected[:3], expected[3] = slope, slope @ (one.mean(0) + two.mean(0)) / 2
        np.testing.assert_allclose(line[row, column], expected, rtol=1e-4, atol=1e-4)


def test_the_outline_comes_back_from_too_far_out():
    lab = scene()
    image = cv2.cvtColor(lab, cv2.COLOR_Lab2BGR)
    labels = first_cut(25)
    logit = np.where(labels, 0.5, -0.5).astype(np.float32)

    plain = refine(image, labels, logit, 0.0)
    placed = refine(image, labels, logit, 0.0, small(lab))

    assert plain[32].sum() == 50
    assert placed[32].sum() == 48
