# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import dataclasses
from typing import Any

import cv2
import numpy as np
import pytest

from gait_segmentation.geometry import BodyFrame, Placement
from gait_segmentation.paper.vocabulary import VocabularyError
from gait_segmentation.results import MatchResult
from gait_segmentation.segmentation import PeopleSegmenter, SegmentationConfig
from gait_segmentation.segmentation.segmenter import (
    MeanLikelihood,
    Segmenter,
    keep_supported,
)
from test.state import differences, remembered

SHAPE = (160, 120)
BODY = BodyFrame(60, 80, 120)


def person(factor: int = 1) -> np.ndarray:
    mask = np.zeros((SHAPE[0] * factor, SHAPE[1] * factor), np.uint8)
    cv2.ellipse(mask, (60 * factor, 80 * factor), (20 * factor, 58 * factor), 0, 0, 360, 255, -1)
    return mask


def picture(factor: int = 1) -> np.ndarray:
    rng = np.random.default_rng(1)
    inside = person(factor) > 0
    image = np.where(inside[:, :, None], (60, 60, 200), (150, 150, 100))
    return np.clip(image + rng.normal(0, 6, image.shape), 0, 255).astype(np.uint8)


def match(prior: np.ndarray | None = None, stamp: int = 1, **changes) -> MatchResult:
    prior = person() if prior is None else prior
    about = 0, 0, 0.2, 0.9, 0.0, 0.8, 0.8, prior
    found = MatchResult(stamp, 1, BODY, Placement(0, 0, 1), *about)
    return dataclasses.replace(found, **changes)


def noisy(seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    values = np.where(person() > 0, 190.0, 60.0) + rng.normal(0, 40, SHAPE)
    return np.clip(values, 0, 255).astype(np.uint8)


def iou(a: np.ndarray, b: np.ndarray) -> float:
    return float(((a > 0) & (b > 0)).sum() / max(((a > 0) | (b > 0)).sum(), 1))


@pytest.mark.parametrize('prior', ['none', 'default', 'paper'])
def test_a_noisy_likelihood_becomes_a_clean_mask(prior: str) -> None:
    result = Segmenter(SegmentationConfig(prior=prior)).segment(picture(), noisy(), match())
    assert result.reason == ''
    assert set(np.unique(result.mask)) == {0, 255}
    assert iou(result.mask, person()) > 0.93


@pytest.mark.parametrize(
    ('before', 'changes'),
    [
        ('default', {'prior': 'paper'}),
        ('paper', {'prior': 'default'}),
        ('paper', {'prior': 'paper', 'paper_reach': 0.02}),
    ],
)
def test_an_exchanged_configuration_is_in_force(before: str, changes: dict[str, Any]) -> None:
    old = SegmentationConfig(prior=before, contrast=0.5)
    new = dataclasses.replace(old, **changes)
    exchanged = Segmenter(old)
    exchanged.config = new
    likelihood = noisy()
    likelihood[40:, 20:60] = 140
    image = np.full((*SHAPE, 3), 120, np.uint8)
    segmenters = (exchanged, Segmenter(new), Segmenter(old))
    found, right, wrong = (each.segment(image, likelihood, match()).mask for each in segmenters)
    assert not np.array_equal(right, wrong)
    assert np.array_equal(found, right)
    with pytest.raises(VocabularyError, match='cannot read the vocabulary'):
        Segmenter(dataclasses.replace(new, vocabulary='none.json'))


@pytest.mark.parametrize('use_refinement', [True, False])
def test_outlines_are_true_at_many_times_the_working_size(use_refinement: bool) -> None:
    """Finer than the outline is cut it is interpolated; steps of the first cut would show."""
    config = SegmentationConfig(use_refinement=use_refinement)
    result = Segmenter(config).segment(picture(7), noisy(), match(body=BODY.scaled(7)))
    assert result.mask.shape == (7 * SHAPE[0], 7 * SHAPE[1])
    assert iou(result.mask, person(7)) > (0.98 if use_refinement else 0.95)


def test_the_prior_fills_what_the_likelihood_lost() -> None:
    likelihood = noisy()
    likelihood[60:90, 50:70] = 90
    image = np.full((*SHAPE, 3), 120, np.uint8)
    without = Segmenter(SegmentationConfig(prior='none', contrast=0.5))
    with_prior = Segmenter(SegmentationConfig(contrast=0.5))
    lost = without.segment(image, likelihood, match()).mask
    kept = with_prior.segment(image, likelihood, match()).mask
    assert iou(kept, person()) > iou(lost, person())


@pytest.mark.parametrize('value', [0, 255])
@pytest.mark.parametrize('prior', ['none', 'default', 'paper'])
def test_a_likelihood_that_says_nothing_gives_a_mask_or_a_reason(value: int, prior: str) -> None:
    segmenter = Segmenter(SegmentationConfig(prior=prior))
    segmenter.segment(picture(), spoilt(), match())
    likelihood = np.full(SHAPE, value, np.uint8)
    result = segmenter.segment(picture(), likelihood, match(stamp=2))
    assert result.mask.any() == (result.reason == '')
    assert value or not result.mask.any()


@pytest.mark.parametrize(
    ('changes', 'reason'),
    [
        ({'body': None, 'track_id': 0}, 'no person is tracked'),
        ({'body': None}, 'the person is hidden or gone'),
        ({'body': BodyFrame(900, 900, 100)}, 'the person is outside of the image'),
    ],
)
def test_nobody_and_outside_are_empty_with_the_reason(changes: dict, reason: str) -> None:
    result = Segmenter().segment(picture(), noisy(), match(np.zeros(SHAPE, np.uint8), **changes))
    assert not result.mask.any()
    assert result.reason == reason


@pytest.mark.parametrize(
    ('similarity', 'elsewhere', 'trusted'), [(0.8, 5, True), (0.45, 5, False), (0.45, 80, True)]
)
def test_a_prior_has_no_say_if_only_the_mask_explains_the_likelihood(
    similarity: float, elsewhere: int, trusted: bool
) -> None:
    # Beside the person is something vague, which the template has.
    beside = np.roll(person(), 20, 1)
    likelihood = np.where(person() > 0, 250, np.where(beside > 0, 110, elsewhere)).astype(np.uint8)
    image = np.full((*SHAPE, 3), 77, np.uint8)
    segmenter = Segmenter(SegmentationConfig())
    for stamp in range(1, 40):
        walk = match(beside, stamp, similarity=similarity)
        mask = segmenter.segment(image, likelihood, walk).mask
    assert bool(mask[80, 88]) == trusted
    # The paper's takes from them what is far from the template.
    segmenter = Segmenter(SegmentationConfig(prior='paper', paper_reach=0.12))
    for stamp in range(1, 40):
        walk = match(beside, stamp, similarity=similarity)
        mask = segmenter.segment(image, likelihood, walk).mask
    left = np.flatnonzero(person()[80])[0] + 1
    assert bool(mask[80, left]) != trusted


def test_a_single_template_that_does_not_fit_does_not_take_its_say_away() -> None:
    beside = np.roll(person(), 20, 1)
    likelihood = np.where(person() > 0, 250, np.where(beside > 0, 110, 5)).astype(np.uint8)
    image, segmenter = np.full((*SHAPE, 3), 77, np.uint8), Segmenter(SegmentationConfig())
    for stamp in range(1, 40):
        walk = match(beside, stamp, similarity=0.1 if stamp == 38 else 0.8)
        mask = segmenter.segment(image, likelihood, walk).mask
    assert mask[80, 88]


def test_the_prior_says_as_much_in_a_window_of_any_size() -> None:
    segmenter, odds = Segmenter(SegmentationConfig()), []
    for rows in (slice(0, 160), slice(10, 150)):
        prior = person()[rows]
        body = BODY.shifted(0, -rows.start)
        found, _ = segmenter._prior_terms(prior, np.zeros((*prior.shape, 3), np.uint8), body)
        odds.append(found[80 - rows.start])
    np.testing.assert_allclose(*odds, rtol=1e-5)


def test_a_foot_that_is_hardly_likely_stays_where_the_template_has_one() -> None:
    body, foot = np.zeros(SHAPE, np.uint8), np.zeros(SHAPE, np.uint8)
    body[30:110, 45:75] = 255
    foot[116:124, 50:67] = 255
    colour = np.where((body | foot)[:, :, None] > 0, (60, 60, 200), (150, 150, 100))
    likelihood = np.where(body > 0, 250, np.where(foot > 0, 150, 5)).astype(np.uint8)
    config = SegmentationConfig(use_refinement=False)
    mask = Segmenter(config).segment(colour.astype(np.uint8), likelihood, match(body | foot)).mask
    assert mask[120, 58]


def test_a_bag_in_the_hand_stays_once_it_was_seen_for_some_time() -> None:
    bag = np.s_[70:118, 100:118]
    segmenter = Segmenter()
    joined, apart = person(), person()
    joined[70:118, 70:118] = 255
    apart[bag] = 255
    likely = 20 + apart // 255 * np.uint8(215)
    assert not segmenter.segment(picture(), likely, match()).mask[bag].any()
    whole = Segmenter(SegmentationConfig(use_support=False))
    assert whole.segment(picture(), likely, match()).mask[bag].mean() > 200
    for stamp in range(2, 22):
        with_arm = 20 + joined // 255 * np.uint8(215)
        segmenter.segment(picture(), with_arm, match(stamp=stamp))
    assert segmenter.segment(picture(), likely, match(stamp=22)).mask[bag].mean() > 200


@pytest.mark.parametrize('prior', ['default', 'paper'])
def test_another_person_leaves_nothing_of_who_was_before(prior: str) -> None:
    used, fresh = (PeopleSegmenter(SegmentationConfig(prior=prior)) for _ in range(2))
    beside = np.roll(person(), 20, 1)
    for stamp in range(1, 9):
        # Somebody in other colours, whom the template does not explain.
        about = match(np.roll(beside, 9, 1), stamp, similarity=0.3)
        likely = [20 + beside // 255 * np.uint8(215)]
        used.update(255 - picture(), likely, [about])
    for stamp in (9, 10):
        other = match(stamp=stamp, track_id=2)
        for each in (used, fresh):
            each.update(picture(), [spoilt()], [other])
    assert differences(*(remembered(each) for each in (used, fresh))) == []


def test_where_somebody_was_seen_is_forgotten_while_nobody_is() -> None:
    image = np.full((*SHAPE, 3), 77, np.uint8)
    bar = np.zeros(SHAPE, np.uint8)
    bar[75:85, 12:110] = 250
    segmenter = Segmenter(SegmentationConfig(prior='none'))

    def reach(stamp: int) -> int:
        small = match(body=BodyFrame(30, 80, 40), stamp=stamp)
        return int(np.flatnonzero(segmenter.segment(image, bar, small).mask.any(axis=0)).max())

    # Each window holds what was found in the one before.
    first, second = reach(1), reach(2)
    assert second > first
    segmenter.segment(image, bar, match(body=None, stamp=3))
    assert reach(4) == first


def spoilt() -> np.ndarray:
    """Return a likelihood as of a poor detector: blurred, shifted and with a hole."""
    likelihood = np.roll(np.where(person() > 0, 230, 25).astype(np.uint8), 3, 1)
    likelihood[60:72] = 25
    return cv2.GaussianBlur(likelihood, (0, 0), 3)


def test_what_is_taken_draws_nothing_to_it() -> None:
    image = np.full((*SHAPE, 3), 77, np.uint8)
    likelihood, taken = np.full(SHAPE, 5, np.uint8), np.zeros(SHAPE, np.uint8)
    likelihood[40:120, 20:57] = likelihood[40:120, 60:100] = 250
    likelihood[40:120, 57:60] = 100
    taken[:, 60:] = 255
    # From within a working pixel on, most of which is not taken.
    wide = np.zeros((3 * SHAPE[0], 3 * SHAPE[1]), np.uint8)
    wide[:, 185:] = 255
    mask = Segmenter().segment(picture(3), noisy(), match(body=BODY.scaled(3)), wide).mask
    assert not mask[:, 185:].any()
    assert mask[240, 150:180].all()
    segmenter = Segmenter(SegmentationConfig(prior='none'))
    alone, beside = (
        segmenter.segment(image, likelihood, match(), each).mask for each in (None, taken)
    )
    assert alone[80, 58]
    assert not beside[80, 58:].any()
    assert beside[80, 35]


# What is learnt from frame to frame.
def scene(x: int, width: int = 15) -> np.ndarray:
    image = np.zeros((120, 160), np.uint8)
    image[60:80, x : x + width] = 255
    return image


def test_what_moves_with_the_body_is_likely_after_some_frames() -> None:
    mean = MeanLikelihood()
    for n in range(24):
        body = BodyFrame(40 + 2 * n, 60, 80 + n / 2)
        there = mean.at(body, (120, 160))
        assert n > 10 or not there.any()
        mean.add_frame(scene(60 + 2 * n), body)
    rows, columns = np.nonzero(mean.at(BodyFrame(88, 60, 92), (120, 160)))
    assert 55 < rows.mean() < 85
    assert 105 < columns.mean() < 130
    assert 100 < len(rows) < 350


def test_what_is_apart_from_the_body_goes() -> None:
    body, labels = np.zeros((60, 80), np.bool_), np.zeros((60, 80), np.bool_)
    body[5:52, 10:25] = True
    labels[5:45, 10:25] = True
    labels[48:51, 12:17] = True  # a shoe
    labels[5:55, 40:70] = True  # a car
    labels[5:35, 26:32] = True  # a bag, of which a third is apart
    evidence = np.ones(labels.shape, np.float32)
    kept = keep_supported(labels, evidence, body, 47.0)
    assert not kept[:, 40:].any()
    assert kept[20, 28]
    assert kept[20, 14]
    assert not kept[49, 14]
    labels[48:54, 10:20] = True
    assert keep_supported(labels, evidence, body, 47.0)[49, 14]
    # From column 30 on it is more than 12 % of 47 pixels away.
    for end in (33, 48):
        labels[:], labels[5:45, 10:25], labels[10:40, 26:end] = False, True, True
        kept = keep_supported(labels, evidence, body, 47.0)
        assert kept[20, 27:30].all() == (end == 33)
