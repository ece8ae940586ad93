# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from functools import partial

import cv2
import numpy as np
import pytest

from gait_segmentation.geometry import Box, check_matched_box
from gait_segmentation.starting import Start, estimate_start
from gait_segmentation.starting.hypotheses import fit_view
from test.walkers import box_of, clip, overlap, small_bank


def estimate(image: np.ndarray, box: Box, **options) -> Start:
    return estimate_start(cv2.cvtColor(image, cv2.COLOR_BGR2Lab), box, small_bank(), **options)


def test_the_first_mask_and_the_body_are_those_of_the_person_in_the_box() -> None:
    frame = clip()[0]
    found = estimate(frame.image, box_of(frame))
    assert found.mask.shape == frame.image.shape[:2]
    assert set(np.unique(found.mask)) <= {0, 255}
    assert overlap(found.mask, frame.truths[0]) > 0.7
    assert found.votes.min() >= 0
    assert found.votes.max() <= 1
    assert np.array_equal(found.votes > 0.5, found.mask > 0)
    box = box_of(frame)
    rows, columns = box.padded(2, 2).slices(frame.image.shape[1], frame.image.shape[0])
    rest = found.mask.copy()
    rest[rows, columns] = 0
    assert not rest.any()
    assert found.body.height == pytest.approx(box.height, rel=0.1)
    assert abs(found.body.center_x - box.center_x) < 0.15 * box.height
    assert abs(found.body.center_y - box.center_y) < 0.1 * box.height


@pytest.mark.parametrize(('degrees', 'off'), [(-18, 8), (-6, 3), (6, 3), (18, 8)])
def test_a_leaning_person_is_found_leaning(degrees: float, off: float) -> None:
    frame = clip()[0]
    size = frame.image.shape[1::-1]
    # cv2 turns against the clock for positive angles, the head then leans to the left.
    turn = cv2.getRotationMatrix2D((size[0] / 2 - 0.5, size[1] / 2 - 0.5), -degrees, 1)
    image = cv2.warpAffine(frame.image, turn, size, borderMode=cv2.BORDER_REFLECT_101)
    truth = cv2.warpAffine(frame.truths[0], turn, size, flags=cv2.INTER_NEAREST)
    found = estimate(image, Box.around(truth == 255))
    assert overlap(found.mask, truth) > 0.7
    assert np.degrees(found.body.angle) == pytest.approx(degrees, abs=off)


@pytest.mark.parametrize(
    'box',
    [
        *(Box(-30, 20, 60, 150), Box(100, 150, 60, 150), Box(5, 5, 1, 1), Box(0, 0, 320, 240)),
        # Just out of view, once they were shrunk.
        *(Box(50, 241, 20, 40), Box(50, -41, 20, 40), Box(340, 20, 9, 10)),
    ],
)
def test_boxes_at_borders_and_of_odd_sizes_give_a_mask(box: Box) -> None:
    found = estimate(clip()[0].image, box)
    assert found.mask.shape == clip()[0].image.shape[:2]
    assert found.body.height >= 1


@pytest.mark.parametrize('table', [True, False])
def test_somebody_cut_by_the_border_or_a_table_is_a_part_of_a_taller_body(table: bool) -> None:
    frame = clip()[0]
    whole = box_of(frame)
    image, truth = frame.image.copy(), frame.truths[0].copy()
    end = round(whole.y + (0.25 if table else 0.3) * whole.height)
    image[end:], truth[end:] = (70, 110, 150), 0
    tight = given = Box.around(truth == 255)
    if not table:
        image, truth = image[:end], truth[:end]
        # As a box that was given comes, shrunk by a margin.
        given = tight.padded(-0.03 * tight.width, -1.5)
    found = estimate(image, given)
    assert overlap(found.mask, truth) > 0.8
    assert table or found.mask[-1].any()
    assert found.body.height > 1.3 * tight.height


@pytest.mark.parametrize('aside', [-1, 1])
def test_somebody_who_reaches_out_is_found_at_the_side_of_the_box(aside: int) -> None:
    frame = clip()[0]
    box = box_of(frame)
    image, truth = frame.image.copy(), frame.truths[0].copy()
    shoulder = round(box.y + 0.25 * box.height)
    hand = round(box.center_x - aside * 0.7 * box.height)
    for picture, colour in ((image, (40, 60, 200)), (truth, (255,))):
        start, end = (round(box.center_x), shoulder), (hand, shoulder)
        cv2.line(picture, start, end, colour, round(0.08 * box.height))
    broad = Box.around(truth == 255)
    found = estimate(image, broad)
    assert overlap(found.mask, truth) > 0.6
    assert (found.body.center_x - broad.center_x) * aside > 0.1 * box.height


def test_a_body_thought_to_go_on_beyond_the_border_can_be_matched() -> None:
    """Of the largest box that is taken, little more than the head is in the image."""
    lab = np.full((60, 60, 3), 128, np.uint8)
    found = estimate_start(lab, Box(20, 51, 60, 237), small_bank())
    body = Box.from_center(found.body.center_x, found.body.center_y, 30, found.body.height)
    check_matched_box(body, (60, 60))
    assert found.body.height >= 237


def test_what_stands_out_counts_also_just_outside_of_the_box() -> None:
    frame = clip()[0]
    box, truth = frame.boxes[0], frame.truths[0]
    wrong = Box(box.x, box.y, box.width, 0.95 * box.height)
    evidence = np.where(truth == 255, 3, np.where(truth == 0, -3, 0)).astype(np.float32)
    blind = estimate(frame.image, wrong)
    told = estimate(frame.image, wrong, evidence=evidence)
    assert overlap(told.mask, truth) > max(0.9, overlap(blind.mask, truth))
    below = Box.around(told.mask)
    assert abs(below.bottom - box.bottom) < 0.03 * box.height


def test_templates_are_laid_onto_the_box_as_its_borders_and_its_room_say() -> None:
    box, shape = Box(60, 20, 50, 60), (100, 160)
    laid = partial(fit_view, small_bank(), box, shape, view=0.0)
    nowhere, both = (False,) * 4, (True, True, False, False)
    assert laid(cuts=both).top == pytest.approx(box.y)
    assert laid(cuts=(True, False, False, False)).top.min() < box.y - 10
    left, right = (laid(cuts=nowhere, aside=side).axis.mean() for side in (-1.0, 1.0))
    assert left < right - 5
    whole = laid(cuts=nowhere)
    likelihood = np.zeros(shape, np.float32)
    likelihood[whole.part] = whole.templates[0] / np.float32(255)
    assert whole.similarities(likelihood)[0] == pytest.approx(1)
