# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from gait_segmentation.matching.evidence import SequenceEvidence

H, W = 24, 16


@pytest.fixture
def templates():
    rng = np.random.default_rng(0)
    result = np.zeros((2, 5, H, W), np.uint8)
    result[:, :, 4:20, 4:12] = 255 * (rng.random((2, 5, 16, 8)) < 0.6)
    return result


def picture(template, place, person=200, ground=50):
    image = np.full((H + 8, W + 8), ground, np.uint8)
    top, left = place
    part = image[top : top + H, left : left + W]
    part[template > 0] = person
    return image


def test_is_half_the_squared_difference_to_the_scaled_likelihood(templates):
    evidence = SequenceEvidence(templates)
    image = picture(templates[1, 3], (4, 4))
    found = evidence.at(image, None, (4, 4), 1, 3)
    scaled = (image[4:-4, 4:-4] - 50.0) / 150
    differences = [0.5 * ((scaled - t / 255) ** 2).sum() for t in templates[1]]
    assert found.argmax() == 3
    assert found.max() - found[3] == 0
    # Other phases may fit better a pixel beside; the right one fits best in place.
    assert (found - found[3] >= differences[3] - np.array(differences) - 1e-3).all()
    assert (found - found[3])[[0, 1, 2, 4]].max() < -5


def test_brightness_and_contrast_do_not_matter(templates):
    evidence = SequenceEvidence(templates)
    strong = evidence.at(picture(templates[0, 2], (4, 4), 255, 0), None, (4, 4), 0, 2)
    weak = evidence.at(picture(templates[0, 2], (4, 4), 160, 110), None, (4, 4), 0, 2)
    assert weak - weak.max() == pytest.approx(strong - strong.max(), abs=1e-2)


def test_a_place_one_pixel_off_is_as_good(templates):
    evidence = SequenceEvidence(templates)
    image = picture(templates[0, 1], (5, 3), 255, 0)
    near = evidence.at(image, None, (4, 4), 0, 1)
    assert near.argmax() == 1
    # At the edge of the search there is no place beyond.
    edge = evidence.at(picture(templates[0, 1], (0, 0), 255, 0), None, (0, 0), 0, 1)
    assert edge.argmax() == 1


def test_unknown_pixels_do_not_count(templates):
    evidence = SequenceEvidence(templates)
    image = picture(templates[0, 4], (4, 4), 255, 0)
    known = np.full(image.shape, 255, np.uint8)
    known[: H // 2 + 4] = 0
    spoilt = image.copy()
    spoilt[: H // 2 + 4] = 77
    clean = evidence.at(np.where(known > 0, image, 0).astype(np.uint8), known, (4, 4), 0, 4)
    assert evidence.at(spoilt, known, (4, 4), 0, 4) == pytest.approx(clean, abs=1e-3)
    assert clean.argmax() == 4


def test_nothing_to_be_told(templates):
    evidence = SequenceEvidence(templates)
    flat = np.full((H + 8, W + 8), 90, np.uint8)
    nothing = np.zeros_like(flat)
    empty = SequenceEvidence(np.zeros_like(templates))
    for model, image, known in (
        (evidence, flat, None),
        (evidence, picture(templates[0, 0], (4, 4)), nothing),
        (empty, flat, None),
    ):
        assert model.at(image, known, (4, 4), 0, 0).tolist() == [0.0] * 5


def test_views_are_blended(templates):
    evidence = SequenceEvidence(templates)
    own, other = (templates[view, 2].astype(float) for view in (0, 1))
    image = np.zeros((H + 8, W + 8), np.uint8)
    image[4:-4, 4:-4] = (own + other) / 2
    alone = evidence.at(image, None, (4, 4), 0, 2)
    blended = evidence.at(image, None, (4, 4), 0, 2, (1, 0.5))
    assert blended.argmax() == 2
    rest = [0, 1, 3, 4]
    assert blended[2] - blended[rest].max() > alone[2] - alone[rest].max()
    assert evidence.at(image, None, (4, 4), 0, 2, (1, 0.0)) == pytest.approx(alone)
