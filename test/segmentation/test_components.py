# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np
from hypothesis import assume, given, settings, strategies as st
from hypothesis.extra.numpy import arrays

from gait_segmentation.segmentation.components import keep_supported


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


def test_what_is_apart_from_the_body_goes() -> None:
    labels = np.zeros((60, 80), np.bool_)
    labels[5:45, 10:25] = True
    labels[48:51, 12:17] = True  # a shoe
    labels[5:55, 40:70] = True  # a car
    body = np.zeros(labels.shape, np.bool_)
    body[5:52, 10:25] = True
    kept = keep_supported(labels, np.ones(labels.shape, np.float32), body, 47.0)
    assert not kept[:, 40:].any()
    assert kept[20, 14]
    assert not kept[49, 14]
    labels[48:54, 10:20] = True
    assert keep_supported(labels, np.ones(labels.shape, np.float32), body, 47.0)[49, 14]


def test_nothing_stays_nothing() -> None:
    labels = np.zeros((5, 5), np.bool_)
    assert not keep_supported(labels, np.ones((5, 5), np.float32)).any()


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
