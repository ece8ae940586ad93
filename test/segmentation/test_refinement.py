# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import cv2
import numpy as np

from gait_segmentation.segmentation.refinement import keep_supported, refine, upsample


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


def test_the_outline_moves_to_the_edge_of_the_image() -> None:
    rng = np.random.default_rng(0)
    cv2.ellipse(image := np.zeros((120, 90), np.uint8), (45, 60), (25, 45), 0, 0, 360, 1, -1)
    true = image > 0
    picture = np.where(true[:, :, None], (60, 60, 200), (160, 160, 90)).astype(np.int16)
    picture = np.clip(picture + rng.normal(0, 4, picture.shape), 0, 255).astype(np.uint8)
    coarse = cv2.resize(image, (30, 40), interpolation=cv2.INTER_AREA) > 0
    logit = np.where(coarse, 1.0, -1.0).astype(np.float32) * 0.2
    plain = upsample(coarse, true.shape)
    fine = refine(picture, coarse, logit, 2.0)
    assert (fine != true).sum() < 0.5 * (plain != true).sum()


def test_the_data_term_is_interpolated_where_the_outline_is() -> None:
    # Without contrast every open pixel follows its own evidence.
    labels = np.zeros((20, 30), np.bool_)
    labels[5:15, 8:20] = True
    logit = np.random.default_rng(3).normal(0, 1, (20, 30)).astype(np.float32)
    shape = (47, 68)
    fine = cv2.resize(logit, shape[::-1], interpolation=cv2.INTER_LINEAR)
    found = refine(np.zeros((*shape, 3), np.uint8), labels, logit, 0.0)
    first = upsample(labels, shape)
    moved = found != first
    assert moved.any()
    assert ((fine > -0.01) | ~found)[moved].all()
    assert ((fine < 0.01) | found)[moved].all()


def test_corners_are_as_round_at_any_resolution() -> None:
    """A working pixel's evidence is shared by the pixels that it becomes."""
    labels = np.zeros((20, 30), np.bool_)
    labels[5:15, 8:20] = True
    logit = np.where(labels, 1.0, -1.0).astype(np.float32)
    for factor in (2, 3, 4, 5):
        flat = np.zeros((20 * factor, 30 * factor, 3), np.uint8)
        area = refine(flat, labels, logit, 2.0).sum() / factor**2
        assert 100 < area < 106
