# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import cv2
import numpy as np
import pytest

from gait_segmentation.geometry import Box, check_matched_box
from gait_segmentation.starting import FirstMask, estimate_first_mask
from gait_segmentation.starting.first_mask import Start, barrier_distance
from test.walkers import box_of, clip, overlap, small_bank


def estimate(image: np.ndarray, box: Box, evidence: np.ndarray | None = None) -> FirstMask:
    lab = cv2.cvtColor(image, cv2.COLOR_BGR2Lab)
    known = np.zeros(lab.shape[:2], np.float32) if evidence is None else evidence
    return estimate_first_mask(lab, box, small_bank(), known)


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
    found = estimate(np.full((60, 60, 3), 128, np.uint8), Box(20, 51, 60, 237))
    body = Box.from_center(found.body.center_x, found.body.center_y, 30, found.body.height)
    check_matched_box(body, (60, 60))
    assert found.body.height >= 237


def test_what_stands_out_counts_also_just_outside_of_the_box() -> None:
    frame = clip()[0]
    box, truth = frame.boxes[0], frame.truths[0]
    wrong = Box(box.x, box.y, box.width, 0.95 * box.height)
    evidence = np.where(truth == 255, 3, np.where(truth == 0, -3, 0)).astype(np.float32)
    blind = estimate(frame.image, wrong)
    told = estimate(frame.image, wrong, evidence)
    assert overlap(told.mask, truth) > max(0.9, overlap(blind.mask, truth))
    below = Box.around(told.mask)
    assert abs(below.bottom - box.bottom) < 0.03 * box.height


BOX = Box(20, 10, 40, 100)


def scene(known: np.ndarray | None = None) -> Start:
    """Return a window with somebody dark in the left half of the box, before something light."""
    lab = np.full((120, 80, 3), 200, np.uint8)
    lab[10:110, 20:40] = 60
    return Start.about(lab, BOX, np.zeros((120, 80), np.float32) if known is None else known)


def test_beside_the_box_only_what_is_known_to_stand_out_may_be_the_person() -> None:
    known = np.zeros((120, 80), np.float32)
    known[111, 25:35] = 3
    inside = scene(known).inside
    assert np.flatnonzero(inside[111]).tolist() == list(range(25, 35))


def test_a_mask_that_touches_all_sides_of_the_box_has_no_gap() -> None:
    found = scene()
    labels = found.inside.copy()
    assert found.gap(labels) == 0
    labels[:, 40:] = False
    assert found.gap(labels) == pytest.approx(0.5)
    labels[:60] = False
    assert found.gap(labels) == pytest.approx(1)
    labels[:] = False
    assert found.gap(labels) == 2


def test_the_distance_is_the_least_range_over_paths() -> None:
    # One channel, one row: the way from the left climbs to 90, that from the right to 50.
    image = np.repeat(np.array([[10, 90, 40, 50, 10]], np.uint8)[:, :, None], 3, axis=2)
    inside = np.array([[False, True, True, True, False]])
    assert barrier_distance(image, inside)[0].tolist() == [0, 240, 120, 120, 0]
