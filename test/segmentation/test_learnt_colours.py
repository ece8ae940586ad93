# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests of colours learnt from a likelihood of any origin."""

import numpy as np

from gait_segmentation.geometry import BodyFrame
from gait_segmentation.segmentation.learnt_colours import LearntColours

BODY = BodyFrame(30.0, 40.0, 60.0, 0.0)
PERSON, GROUND = (60, 150, 110), (180, 120, 140)


def scene() -> tuple[np.ndarray, np.ndarray]:
    """Return (80, 60, 3) Lab colours and the (80, 60) bool person in them."""
    person = np.zeros((80, 60), bool)
    person[10:70, 20:40] = True
    return np.where(person[:, :, None], PERSON, GROUND).astype(np.uint8), person


def shifted(person: np.ndarray) -> np.ndarray:
    """Return a likelihood that lies 4 pixels to the right and has a hole."""
    likelihood = np.where(np.roll(person, 4, 1), 230, 25).astype(np.uint8)
    likelihood[30:40, 20:44] = 25
    return likelihood


def test_nothing_learnt_says_nothing():
    assert not LearntColours().odds(scene()[0], BODY).any()
    assert not LearntColours().ready


def test_colours_are_better_than_the_likelihood_they_come_from():
    lab, person = scene()
    colours = LearntColours()

    colours.learn(lab, BODY, shifted(person))
    odds = colours.odds(lab, BODY)

    assert colours.ready
    assert ((odds > 0) == person).mean() > ((shifted(person) > 127) == person).mean()
    assert (odds[15:25, 22:38] > 0).all()
    assert (odds[:, :10] < 0).all()


def test_a_colour_counts_most_at_the_height_at_which_it_was_seen():
    # The ground has the colour of the coat, but only at the feet.
    lab, person = scene()
    lab[50:][~person[50:]] = PERSON
    lab[50:][person[50:]] = (20, 128, 128)
    colours = LearntColours()

    colours.learn(lab, BODY, np.where(person, 255, 0).astype(np.uint8))
    odds = colours.odds(np.full_like(lab, PERSON), BODY)

    assert (odds[15:30] > 1).all()
    assert (odds[60:68] < -0.7).all()


def test_an_undecided_likelihood_teaches_nothing():
    lab, _ = scene()
    colours = LearntColours()

    colours.learn(lab, BODY, np.full((80, 60), 128, np.uint8))

    assert not colours.odds(lab, BODY).any()


def test_one_side_alone_says_nothing():
    lab, _ = scene()
    for value in (0, 255):
        colours = LearntColours()
        colours.learn(lab, BODY, np.full((80, 60), value, np.uint8))
        assert not colours.odds(lab, BODY).any()


def test_the_cut_corrects_the_likelihood():
    lab, person = scene()
    colours = LearntColours()
    wrong = np.where(person, 90, 165).astype(np.uint8)

    colours.learn(lab, BODY, wrong, person)

    assert ((colours.odds(lab, BODY) > 0) == person).all()


def test_old_colours_are_forgotten():
    lab, person = scene()
    likelihood = np.where(person, 255, 0).astype(np.uint8)
    colours = LearntColours()
    colours.learn(lab, BODY, likelihood)

    for _ in range(200):
        colours.learn(lab, BODY, 255 - likelihood)

    assert ((colours.odds(lab, BODY) < 0) == person).all()
