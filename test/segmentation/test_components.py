# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import assume, example, given, settings, strategies as st
from hypothesis.extra.numpy import arrays

from gait_segmentation.segmentation.components import fill_holes, keep_supported


def test_the_best_supported_part_stays_and_the_rest_goes() -> None:
    labels = np.zeros((10, 20), np.bool_)
    labels[1:9, 1:5] = True
    labels[1:9, 10:18] = True
    support = np.zeros((10, 20), np.float32)
    support[:, :6] = 1
    kept = keep_supported(labels, support)
    assert kept[:, :6].any()
    assert not kept[:, 8:].any()


def test_a_well_supported_second_part_stays() -> None:
    labels = np.zeros((20, 10), np.bool_)
    labels[1:12, 2:8] = True
    labels[14:19, 2:5] = True
    kept = keep_supported(labels, np.ones((20, 10), np.float32))
    assert np.array_equal(kept, labels)


def test_what_lies_on_the_body_may_be_small() -> None:
    labels = np.zeros((60, 40), np.bool_)
    labels[5:45, 10:25] = True
    labels[48:51, 12:17] = True  # a shoe
    labels[48:51, 33:38] = True  # a bright stone
    body = np.zeros(labels.shape, np.bool_)
    body[5:52, 10:25] = True
    kept = keep_supported(labels, np.ones(labels.shape, np.float32), body, 47.0)
    assert kept[49, 14]
    assert not kept[49, 35]


@pytest.mark.parametrize(
    ('left', 'likelihood', 'seen', 'stays'),
    [(28, 242, 0.6, True), (28, 236, 0.6, False), (50, 242, 0.6, False), (28, 242, 0.9, False)],
    ids=['other half', 'unlikely', 'passer-by', 'mirror image'],
)
def test_the_other_half_of_who_comes_out_behind_a_post_stays(
    left: int, likelihood: int, seen: float, stays: bool
) -> None:
    body = np.zeros((60, 80), np.bool_)
    body[5:55, 5:20] = True
    support = np.where(body, 0.95, 0.47).astype(np.float32)
    labels = np.zeros(body.shape, np.bool_)
    labels[5:55, 20 - round(15 * seen) : 20] = True
    labels[5:55, left : left + 10] = True
    evidence = np.where(labels, likelihood, 0).astype(np.uint8)
    kept = keep_supported(labels, support, body, 50.0, evidence)
    assert kept[30, 14]
    assert bool(kept[30, left + 5]) == stays


def test_nothing_stays_nothing() -> None:
    labels = np.zeros((5, 5), np.bool_)
    assert not keep_supported(labels, np.ones((5, 5), np.float32)).any()
    assert not fill_holes(labels, 3).any()


def test_only_small_inner_holes_are_filled() -> None:
    labels = np.ones((20, 20), np.bool_)
    labels[3, 3] = False
    labels[8:14, 8:14] = False
    labels[0, 10] = False
    filled = fill_holes(labels, 4)
    assert filled[3, 3]
    assert not filled[10, 10]
    assert not filled[0, 10]


def parts_of(labels: np.ndarray, diagonal: bool) -> list[np.ndarray]:
    """Return each component of a mask, found by growing it step by step."""
    rest, found = labels.copy(), []
    shape = cv2.MORPH_RECT if diagonal else cv2.MORPH_CROSS
    kernel = cv2.getStructuringElement(shape, (3, 3))
    while rest.any():
        part = np.zeros(labels.shape, np.uint8)
        part.flat[int(rest.argmax())] = 1
        while not np.array_equal(part, grown := cv2.dilate(part, kernel) & labels):
            part = grown
        found.append(part > 0)
        rest &= part == 0
    return found


MASKS = arrays(np.bool_, st.tuples(st.integers(1, 7), st.integers(1, 7)))
SEVERAL = arrays(np.bool_, st.tuples(st.integers(3, 7), st.integers(3, 7)), fill=st.nothing())


@given(MASKS, st.integers(0, 5))
@example(np.pad(np.zeros((1, 2), np.bool_), 2, constant_values=True), 2)
def test_holes_are_what_the_border_cannot_be_reached_from(
    labels: np.ndarray, largest: int
) -> None:
    border = np.ones(labels.shape, np.bool_)
    border[1:-1, 1:-1] = False
    expected = labels.copy()
    for part in parts_of(~labels, diagonal=True):
        if not (part & border).any() and part.sum() <= largest:
            expected |= part
    assert np.array_equal(fill_holes(labels, largest), expected)


@settings(max_examples=60)
@given(SEVERAL, st.integers(0, 2**32), st.floats(0, 40))
def test_parts_are_kept_by_their_support_and_by_where_they_lie(
    labels: np.ndarray, seed: int, height: float
) -> None:
    rng = np.random.default_rng(seed)
    support = (rng.integers(0, 9, labels.shape) / 8).astype(np.float32)
    evidence = rng.integers(200, 256, labels.shape).astype(np.uint8)
    body = rng.random(labels.shape) < 0.2
    parts = parts_of(labels, diagonal=False)
    assume(len(parts) > 1 and body.any())
    away = cv2.distanceTransform((~body).view(np.uint8), cv2.DIST_L2, 3)
    reach = 0.3 * height if (labels & body).sum() < 0.8 * body.sum() else -1
    certain = [
        evidence[part].mean() >= (240 if away[part].mean() <= reach else 245) for part in parts
    ]
    near = away <= 0.12 * height
    for part, sure in zip(parts, certain, strict=True):
        near |= part & sure
    worth = [float((support * near)[part].sum()) for part in parts]
    expected = np.zeros_like(labels)
    for part, own, sure in zip(parts, worth, certain, strict=True):
        least = 0.02 if sure or (away <= 0.03 * height)[part].mean() > 0.5 else 0.04
        well = own > least * max(worth) and own > 0.4 * part.sum()
        if (well and near[part].mean() >= 0.5) or own == max(worth):
            expected |= part
    assume(worth.count(max(worth)) == 1)
    found = keep_supported(labels, support, body, height, evidence)
    assert np.array_equal(found, expected)
