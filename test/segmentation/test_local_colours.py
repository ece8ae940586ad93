# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests of the colours on both sides of an outline."""

import cv2
import numpy as np

from gait_segmentation.segmentation.local_colours import add_odds, discriminant
from gait_segmentation.segmentation.refinement import refine

SCALE = 0.5
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
    odds = np.zeros(image.shape[:2], np.float32)
    given = np.zeros(image.shape[:2], np.int8)
    add_odds(image, discriminant(small(image), labels), (0, 0, SCALE), given, 1.0, odds)
    return odds


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
    assert not discriminant(small(scene()), np.zeros((32, 48), bool)).any()
    assert not discriminant(small(scene()), np.ones((32, 48), bool)).any()


def test_given_pixels_get_nothing():
    odds = np.zeros((64, 96), np.float32)
    given = np.ones((64, 96), np.int8)

    add_odds(scene(), discriminant(small(scene()), first_cut()), (0, 0, SCALE), given, 1.0, odds)

    assert not odds.any()


def test_a_part_of_the_image_finds_its_place():
    image, labels = scene(), first_cut()
    line = discriminant(small(image), labels)
    part = np.zeros((20, 30), np.float32)

    add_odds(image[10:30, 40:70], line, (10, 40, SCALE), np.zeros((20, 30), np.int8), 1.0, part)

    np.testing.assert_array_equal(part, odds_of(image, labels)[10:30, 40:70])


def test_the_outline_comes_back_from_too_far_out():
    lab = scene()
    image = cv2.cvtColor(lab, cv2.COLOR_Lab2BGR)
    labels = first_cut(25)
    logit = np.where(labels, 0.5, -0.5).astype(np.float32)

    plain = refine(image, labels, logit, 0.0)
    placed = refine(image, labels, logit, 0.0, discriminant(small(lab), labels))

    assert plain[32].sum() == 50
    assert placed[32].sum() == 48
