# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from gait_segmentation.detector import person_masks
from gait_segmentation.detector.detection import Detection
from gait_segmentation.detector.person_masks import PersonMasks
from gait_segmentation.geometry import Box
from test.networks import WOMAN, demo_picture

SIZE = 300


def red(blob):
    """A network that takes for a person what is red."""
    assert blob.shape == (1, 3, 256, 256)
    return 8 * (blob[0, 2:] - 127.5)


@pytest.fixture
def drawer(monkeypatch):
    monkeypatch.setattr(person_masks, 'Engine', lambda path: red)
    return PersonMasks()


def scene(*boxes):
    image = np.zeros((SIZE, SIZE, 3), np.uint8)
    for box in boxes:
        image[box.slices(SIZE, SIZE)] = (0, 0, 255)
    return image


def overlap(person, box, scale=1.0, shift=(0.0, 0.0)):
    """Return how alike a mask and a box are, at another scale and so far on."""
    side = round(SIZE * scale)
    found = person.mask.drawn((slice(0, side), slice(0, side)), scale, shift) > 127
    expected = np.zeros((side, side), np.bool_)
    expected[box.scaled(scale).shifted(*shift).slices(side, side)] = True
    return (expected & found).sum() / (expected | found).sum()


@pytest.mark.parametrize(
    ('scale', 'shift'), [(1.0, (0.0, 0.0)), (0.5, (0.0, 0.0)), (2.0, (9, -5))]
)
def test_everybody_who_is_seen_is_drawn_where_they_are(drawer, scale, shift):
    # One reaches over the border.
    boxes = Box(20, 60, 40, 120), Box(150, 100, 60, 180), Box(270, 10, 60, 80)
    seen, drawn = drawer.draw(scene(*boxes), (), [Detection(each, 0.9) for each in boxes], 5)
    assert drawn == ()
    for person, box in zip(seen, boxes, strict=True):
        assert person.box == box
        assert overlap(person, box, scale, shift) > 0.9


def test_each_has_a_mask_of_their_own_and_no_more_than_is_about_their_box(drawer):
    own, other = Box(20, 60, 40, 120), Box(120, 60, 40, 120)
    seen, _ = drawer.draw(scene(own, other), (), [Detection(own, 0.9), Detection(other, 0.9)], 5)
    for person, box in zip(seen, (own, other), strict=True):
        assert overlap(person, box) > 0.9


def test_who_is_known_is_drawn_whether_they_are_seen_or_not(drawer):
    box, off = Box(60, 60, 40, 120), Box(66, 63, 40, 120)
    _, (person,) = drawer.draw(scene(box), [off], None, 5)
    assert (person.score, person.box.iou(box)) == (0.0, pytest.approx(1, abs=0.1))
    assert overlap(person, box) > 0.9
    # The box of the mask is no better if there is hardly anything in it.
    _, (person,) = drawer.draw(scene(), [off], [], 5)
    assert person.box == off
    (person,), drawn = drawer.draw(scene(box), [off], [Detection(box, 0.3)], 5)
    assert (drawn, person.box) == ((), box)
    assert person.mask is not None


@pytest.mark.parametrize(('score', 'is_drawn'), [(0.3, False), (0.5, True)])
def test_who_is_new_must_be_seen_clearly(drawer, score, is_drawn):
    box = Box(20, 60, 40, 120)
    (person,), _ = drawer.draw(scene(box), (), [Detection(box, score)], 5)
    assert (person.mask is not None) == is_drawn


@pytest.mark.parametrize(
    ('most', 'new', 'known'), [(9, [True, True], 3), (4, [True, True], 2), (1, [False, True], 0)]
)
def test_only_so_many_are_drawn_those_first_who_are_new(drawer, most, new, known):
    boxes = [Box(10 + 50 * k, 60, 30, 120) for k in range(5)]
    rest = [Detection(boxes[3], 0.8), Detection(boxes[4], 0.9)]
    seen, drawn = drawer.draw(scene(*boxes), boxes[:3], rest, most)
    assert [each.mask is not None for each in seen] == new
    assert [each.box.iou(box) > 0.8 for each, box in zip(drawn, boxes, strict=False)] == (
        [True] * known
    )


def test_the_network_draws_a_person_and_nothing_else():
    (person,), _ = PersonMasks().draw(demo_picture(), (), [Detection(WOMAN, 0.9)], 1)
    found = person.mask.drawn((slice(0, 212), slice(0, 560)), 1.0, (0.0, 0.0)) > 127
    assert Box.around(found).iou(WOMAN) > 0.7
    assert 0.2 < found.sum() / (WOMAN.width * WOMAN.height) < 0.7
