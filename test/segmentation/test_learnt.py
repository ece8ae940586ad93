# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import cv2
import numpy as np

from gait_segmentation.geometry import BodyFrame
from gait_segmentation.segmentation.learnt import LearntColours, MeanLikelihood

SHAPE = (120, 160)
BODY = BodyFrame(30.0, 40.0, 60.0, 0.0)
PERSON, GROUND = (60, 150, 110), (180, 120, 140)


def scene(x: int, width: int = 15) -> np.ndarray:
    image = np.zeros(SHAPE, np.uint8)
    image[60:80, x : x + width] = 255
    return image


def test_what_moves_with_the_body_is_likely_after_some_frames() -> None:
    mean = MeanLikelihood()
    for n in range(24):
        body = BodyFrame(40 + 2 * n, 60, 80 + n / 2)
        there = mean.at(body, SHAPE)
        assert n > 10 or not there.any()
        mean.add_frame(scene(60 + 2 * n), body)
    rows, columns = np.nonzero(mean.at(BodyFrame(88, 60, 92), SHAPE))
    assert 55 < rows.mean() < 85
    assert 105 < columns.mean() < 130
    assert 100 < len(rows) < 350


def coloured() -> tuple[np.ndarray, np.ndarray]:
    """Return (80, 60, 3) Lab colours and the (80, 60) bool person in them."""
    person = np.zeros((80, 60), bool)
    person[10:70, 20:40] = True
    return np.where(person[:, :, None], PERSON, GROUND).astype(np.uint8), person


def shifted(person: np.ndarray) -> np.ndarray:
    """Return a likelihood that lies 4 pixels to the right and has a hole."""
    likelihood = np.where(np.roll(person, 4, 1), 230, 25).astype(np.uint8)
    likelihood[30:40, 20:44] = 25
    return likelihood


def test_colours_are_better_than_the_likelihood_they_come_from() -> None:
    lab, person = coloured()
    colours = LearntColours()
    colours.add_frame(lab, BODY, shifted(person))
    odds = colours.odds(lab, BODY)
    assert colours.ready
    assert ((odds > 0) == person).mean() > ((shifted(person) > 127) == person).mean()
    assert (odds[15:25, 22:38] > 0).all()
    assert (odds[:, :10] < 0).all()


def test_a_colour_counts_most_at_the_height_at_which_it_was_seen() -> None:
    # The ground has the colour of the coat, but only at the feet.
    lab, person = coloured()
    lab[50:][~person[50:]] = PERSON
    lab[50:][person[50:]] = (20, 128, 128)
    colours = LearntColours()
    colours.add_frame(lab, BODY, np.where(person, 255, 0).astype(np.uint8))
    odds = colours.odds(np.full_like(lab, PERSON), BODY)
    assert (odds[15:30] > 1).all()
    assert (odds[60:68] < -0.7).all()


def test_after_two_frames_each_counts_about_half_and_old_colours_are_forgotten() -> None:
    lab, person = coloured()
    colours = LearntColours()
    swapped = np.where(person[:, :, None], GROUND, PERSON).astype(np.uint8)
    for number, seen in enumerate([lab] + [swapped] * 200):
        colours.add_frame(seen, BODY, np.where(person, 255, 0).astype(np.uint8), person)
        assert number != 1 or np.abs(colours.odds(lab, BODY)).max() < 0.3
    assert ((colours.odds(lab, BODY) < 0) == person).all()


def test_pixels_that_touch_the_person_teach_nothing_of_the_surroundings() -> None:
    lab, person = coloured()
    rim, mixed = cv2.dilate(person.view(np.uint8), np.ones((3, 3))) > 0, (120, 128, 128)
    lab[rim & ~person] = mixed
    colours = LearntColours()
    colours.add_frame(lab, BODY, np.where(rim, 128, 0).astype(np.uint8), person)
    assert np.abs(colours.odds(np.full_like(lab, mixed), BODY)).max() < 0.5
