# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import replace

import cv2
import numpy as np
import pytest

from gait_segmentation.errors import InputError
from gait_segmentation.geometry import BodyFrame
from gait_segmentation.results import MatchResult
from gait_segmentation.segmentation import PeopleMasks, PeopleSegmenter, SegmentationConfig
from test.tracking.figures import BLUE, Figure, picture


def match(figure: Figure | None, track_id: int = 1) -> MatchResult:
    prior = np.zeros((180, 320), np.uint8) if figure is None else figure.mask()
    body = None if figure is None else BodyFrame(figure.x, figure.y, figure.height)
    return MatchResult(1, track_id, body, None, 0, 0, 0.0, 1.0, 0.0, 1.0, 1.0, prior)


def cut(*figures: Figure) -> PeopleMasks:
    """Cut figures out whose likelihoods say yes also where others hide them."""
    image, _ = picture(sorted(figures, key=lambda each: each.y + each.height / 2))
    matches = [match(figure, k + 1) for k, figure in enumerate(figures)]
    likelihoods = [cv2.GaussianBlur(each.shape_prior, (0, 0), 1) for each in matches]
    return PeopleSegmenter(max_people=len(figures)).update(image, likelihoods, matches)


def test_each_pixel_has_one_owner_and_the_order_does_not_change_that() -> None:
    people = _, near, _ = Figure(150, y=86.0), Figure(164, BLUE, y=94.0), Figure(60)
    found, turned = cut(*people), cut(*people[::-1])
    for one, two in zip(found.people, turned.people[::-1], strict=True):
        np.testing.assert_array_equal(one.mask, two.mask)
    masks = np.array([each.mask > 0 for each in found.people])
    assert masks.sum(axis=0).max() == 1
    np.testing.assert_array_equal(found.labels, np.tensordot([1, 2, 3], masks, 1))
    np.testing.assert_array_equal(found.mask > 0, masks.any(axis=0))
    own = near.mask() > 0
    # What both could have is the nearer one's.
    assert (masks[1] & own).sum() > 0.9 * own.sum()
    assert masks[0].sum() > 100


@pytest.mark.parametrize(
    ('likelihood', 'prior', 'message'),
    [
        (np.zeros((30, 40)), np.zeros((30, 40), np.uint8), 'likelihood must be .*float64'),
        (np.zeros((30, 40), np.uint8), np.zeros((30, 40, 1), np.uint8), 'shape prior must be'),
        (np.zeros((30, 40), np.uint8), np.zeros((30, 41), np.uint8), 'must have the same size'),
        (np.zeros((30, 30), np.uint8), np.zeros((30, 30), np.uint8), 'proportions'),
        (np.zeros((120, 160), np.uint8), np.zeros((120, 160), np.uint8), 'no larger'),
    ],
)
def test_maps_that_do_not_fit_are_refused(
    likelihood: np.ndarray, prior: np.ndarray, message: str
) -> None:
    given = replace(match(None), shape_prior=prior)
    with pytest.raises(InputError, match=message):
        PeopleSegmenter().update(np.zeros((60, 80, 3), np.uint8), [likelihood], [given])


@pytest.mark.parametrize(
    'body',
    [BodyFrame(60, 90, 1e7), BodyFrame(1e9, 90, 80), BodyFrame(60, 90, 80, np.inf)],
    ids=str,
)
def test_a_body_that_makes_no_sense_changes_nothing(body: BodyFrame) -> None:
    near, far = Figure(60), Figure(200, BLUE)
    image, _ = picture([near, far])
    matches = [match(near, 1), match(far, 2)]
    likelihoods = [each.shape_prior for each in matches]
    plain, asked = PeopleSegmenter(max_people=2), PeopleSegmenter(max_people=2)
    for _ in range(4):
        expected = plain.update(image, likelihoods, matches)
        found = asked.update(image, likelihoods, matches)
        np.testing.assert_array_equal(found.labels, expected.labels)
        with pytest.raises(InputError, match='body must be finite, at most'):
            asked.update(image, likelihoods, [matches[0], replace(matches[1], body=body)])


def doubtful() -> tuple[np.ndarray, list[np.ndarray], list[MatchResult]]:
    """Return an image, likelihoods and matches of two people beside whom more may be theirs."""
    figures = Figure(60), Figure(200, BLUE)
    matches = [match(figure, k + 1) for k, figure in enumerate(figures)]
    image, likelihoods = np.full((180, 320, 3), 120, np.uint8), []
    for figure, each in zip(figures, matches, strict=True):
        beside = np.zeros_like(each.shape_prior)
        beside[60:120, round(figure.x) : round(figure.x) + 40] = 140
        likelihoods.append(np.maximum(each.shape_prior, beside))
    return image, likelihoods, matches


def test_an_exchanged_configuration_is_in_force_in_every_slot() -> None:
    old, new = SegmentationConfig(), SegmentationConfig(prior='none')
    exchanged, *others = (PeopleSegmenter(each, max_people=2) for each in (old, new, old))
    exchanged.config = new
    found, right, wrong = (each.update(*doubtful()).people for each in (exchanged, *others))
    for one, two, other in zip(found, right, wrong, strict=True):
        assert np.array_equal(one.mask, two.mask)
        assert not np.array_equal(one.mask, other.mask)


def test_after_a_reset_each_slot_learns_of_its_own_person_again() -> None:
    image, likelihoods, matches = doubtful()
    # Templates that do not fit are believed less and less.
    poor = [replace(each, similarity=0.1) for each in matches]
    segmenter = PeopleSegmenter(max_people=2)
    first, *_, last = (segmenter.update(image, likelihoods, poor).labels for _ in range(20))
    segmenter.reset()
    again, *_, end = (segmenter.update(image, likelihoods, poor).labels for _ in range(20))
    assert not np.array_equal(first, last)
    assert np.array_equal((first, last), (again, end))


def test_a_body_far_larger_than_the_image_has_no_outline_in_it() -> None:
    figure = Figure(60)
    image, _ = picture([figure])
    one = match(figure)
    segmenter = PeopleSegmenter()
    assert segmenter.update(image, [one.shape_prior], [one]).mask.any()
    larger = replace(one, body=BodyFrame(60, 90, 320 * 8.1))
    found = segmenter.update(image, [one.shape_prior], [larger])
    assert not found.mask.any()
    assert found.people[0].reason == 'the person is far larger than the image'
