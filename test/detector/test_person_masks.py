# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from gait_segmentation.detector import person_masks
from gait_segmentation.detector.person_masks import PersonMasks
from gait_segmentation.geometry import Box
from test.networks import WOMAN, demo_picture

SIZE, PRESENCE = 300, 3.5


def red(blob):
    """A network that takes for a person what is red."""
    assert blob.shape == (1, 3, 224, 224)
    return np.append(8 * (blob[0, 2] - 127.5), PRESENCE)


@pytest.fixture
def drawer(monkeypatch):
    monkeypatch.setattr(person_masks, 'Engine', lambda path: red)
    return PersonMasks()


def scene(*boxes):
    image = np.zeros((SIZE, SIZE, 3), np.uint8)
    for box in boxes:
        image[box.slices(SIZE, SIZE)] = (0, 0, 255)
    return image


def overlap(mask, box, scale=1.0, shift=(0.0, 0.0)):
    """Return how alike a mask and a box are, at another scale and so far on."""
    side = round(SIZE * scale)
    found = mask.drawn((slice(0, side), slice(0, side)), scale, shift) > 127
    expected = np.zeros((side, side), np.bool_)
    expected[box.scaled(scale).shifted(*shift).slices(side, side)] = True
    return (expected & found).sum() / (expected | found).sum()


@pytest.mark.parametrize(
    ('scale', 'shift'), [(1.0, (0.0, 0.0)), (0.5, (0.0, 0.0)), (2.0, (9, -5))]
)
def test_everybody_is_drawn_where_they_are(drawer, scale, shift):
    # One reaches over the border.
    boxes = Box(20, 60, 40, 120), Box(150, 100, 60, 180), Box(270, 10, 60, 80)
    for box in boxes:
        assert overlap(drawer.draw(scene(*boxes), box), box, scale, shift) > 0.9


def test_of_whom_the_lower_border_cuts_off_the_square_is_about_all_of_them(drawer):
    whole, cut = Box(60, 100, 60, 150), Box(60, 200, 60, 100)
    assert drawer.draw(scene(cut), cut).scale == drawer.draw(scene(whole), whole).scale
    slim, lower = Box(60, 100, 20, 150), Box(60, 150, 20, 150)
    assert drawer.draw(scene(slim), slim).scale == drawer.draw(scene(lower), lower).scale


def test_each_has_a_mask_of_their_own_and_no_more_than_is_about_their_box(drawer):
    own, other = Box(20, 60, 40, 120), Box(120, 60, 40, 120)
    for box in (own, other):
        assert overlap(drawer.draw(scene(own, other), box), box) > 0.9
    # An arm may be out of it.
    assert overlap(drawer.draw(scene(own, other), Box(30, 60, 20, 120)), own) > 0.9


def test_a_mask_fits_a_box_that_is_a_little_off_and_has_a_better_one(drawer):
    box, off = Box(60, 60, 40, 120), Box(66, 63, 40, 120)
    mask = drawer.draw(scene(box), off)
    assert mask.fits(off)
    assert mask.presence == PRESENCE
    assert mask.box.iou(box) == pytest.approx(1, abs=0.1)
    # Not if there is hardly anything in it, or something else.
    assert not drawer.draw(scene(), off).fits(off)
    assert not drawer.draw(scene(Box(60, 100, 20, 40)), off).fits(off)


def test_the_network_draws_a_person_and_nothing_else():
    mask = PersonMasks().draw(demo_picture(), WOMAN)
    found = mask.drawn((slice(0, 212), slice(0, 560)), 1.0, (0.0, 0.0)) > 127
    assert Box.around(found).iou(WOMAN) > 0.7
    assert 0.2 < found.sum() / (WOMAN.width * WOMAN.height) < 0.7


def test_the_network_tells_a_person_from_what_is_beside_her():
    masks, image = PersonMasks(), demo_picture()
    beside = [WOMAN.shifted(-each, 0) for each in (100, 200, 300)]
    assert masks.draw(image, WOMAN).presence > 0
    assert max(masks.draw(image, each).presence for each in beside) < -4
