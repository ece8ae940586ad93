# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
from hypothesis import assume, given, settings, strategies as st
from hypothesis.extra.numpy import arrays

from gait_segmentation.segmentation.refinement import finest, keep_supported, refine, upsample


def test_what_is_apart_from_the_body_goes() -> None:
    labels = np.zeros((60, 80), np.bool_)
    labels[5:45, 10:25] = True
    labels[48:51, 12:17] = True  # a shoe
    labels[5:55, 40:70] = True  # a car
    labels[5:35, 26:32] = True  # a bag, of which a third is apart
    body = np.zeros(labels.shape, np.bool_)
    body[5:52, 10:25] = True
    kept = keep_supported(labels, np.ones(labels.shape, np.float32), body, 47.0)
    assert not kept[:, 40:].any()
    assert kept[20, 28]
    assert kept[20, 14]
    assert not kept[49, 14]
    labels[48:54, 10:20] = True
    assert keep_supported(labels, np.ones(labels.shape, np.float32), body, 47.0)[49, 14]


def parts_of(labels: np.ndarray) -> list[np.ndarray]:
    """Return each component of a mask, found by growing it step by step."""
    rest, found = labels.copy(), []
    kernel = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    while rest.any():
        part = np.zeros(labels.shape, np.uint8)
        part.flat[int(rest.argmax())] = 1
        while not np.array_equal(part, grown := cv2.dilate(part, kernel) & labels):
            part = grown
        found.append(part > 0)
        rest &= part == 0
    return found


SEVERAL = arrays(np.bool_, st.tuples(st.integers(3, 7), st.integers(3, 7)), fill=st.nothing())


@settings(max_examples=60)
@given(SEVERAL, st.integers(0, 2**32))
def test_parts_are_kept_by_their_support(labels: np.ndarray, seed: int) -> None:
    rng = np.random.default_rng(seed)
    support = (rng.integers(0, 9, labels.shape) / 8).astype(np.float32)
    parts = parts_of(labels)
    assume(len(parts) > 1)
    worth = [float(support[part].sum()) for part in parts]
    assume(worth.count(max(worth)) == 1)
    expected = np.zeros_like(labels)
    for part, own in zip(parts, worth, strict=True):
        if own > 0.04 * max(worth) or own == max(worth):
            expected |= part
    assert np.array_equal(keep_supported(labels, support), expected)


def test_upsampling_interpolates_the_outline() -> None:
    labels = np.zeros((10, 10), np.bool_)
    labels[3:7, 3:7] = True
    large = upsample(labels, (30, 30))
    assert large.shape == (30, 30)
    assert large[10:20, 10:20].all()
    assert 0.8 < large.sum() / (9 * labels.sum()) < 1.1
    assert upsample(labels, (10, 10)) is labels


def test_the_outline_moves_to_the_edge_of_the_image() -> None:
    rng = np.random.default_rng(0)
    true = np.zeros((120, 90), np.bool_)
    cv2.ellipse(image := np.zeros((120, 90), np.uint8), (45, 60), (25, 45), 0, 0, 360, 1, -1)
    true = image > 0
    picture = np.where(true[:, :, None], (60, 60, 200), (160, 160, 90)).astype(np.int16)
    picture = np.clip(picture + rng.normal(0, 4, picture.shape), 0, 255).astype(np.uint8)
    coarse = cv2.resize(image, (30, 40), interpolation=cv2.INTER_AREA) > 0
    logit = np.where(coarse, 1.0, -1.0).astype(np.float32) * 0.2
    plain = upsample(coarse, true.shape)
    fine = refine(picture, coarse, logit, 2.0)
    assert (fine != true).sum() < 0.5 * (plain != true).sum()


def test_nothing_to_refine_stays() -> None:
    labels = np.zeros((10, 10), np.bool_)
    picture = np.zeros((20, 20, 3), np.uint8)
    assert not refine(picture, labels, np.zeros((10, 10), np.float32), 2.0).any()


def test_windows_are_scaled_down_to_what_the_outline_needs() -> None:
    picture = np.zeros((250, 200, 3), np.uint8)
    assert finest(picture, (100, 80)) is picture
    assert finest(picture, (50, 40)).shape == (125, 100, 3)
    assert finest(picture[:, :1], (50, 1)).shape == (125, 3, 3)


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


def test_only_the_band_about_the_outline_changes() -> None:
    labels = np.zeros((20, 30), np.bool_)
    labels[5:15, 8:20] = True
    logit = np.where(labels, -9.0, 9.0).astype(np.float32)
    found = refine(np.zeros((40, 60, 3), np.uint8), labels, logit, 0.0)
    assert found[15:25, 21:35].all()
    assert not found[:5].any()


def test_corners_are_as_round_at_any_resolution() -> None:
    """A working pixel's evidence is shared by the pixels that it becomes."""
    labels = np.zeros((20, 30), np.bool_)
    labels[5:15, 8:20] = True
    logit = np.where(labels, 1.0, -1.0).astype(np.float32)
    for factor in (2, 3, 4, 5):
        flat = np.zeros((20 * factor, 30 * factor, 3), np.uint8)
        area = refine(flat, labels, logit, 2.0).sum() / factor**2
        assert 100 < area < 106
