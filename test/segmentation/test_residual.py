# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.geometry import BodyFrame
from gait_segmentation.segmentation.residual import PersonalShape

BODY = BodyFrame(50, 60, 100)


def block(x: int) -> np.ndarray:
    mask = np.zeros((120, 100), np.uint8)
    mask[10:110, x : x + 30] = 255
    return mask


NOTHING = np.zeros((120, 100), np.uint8)


def shown(shape: PersonalShape, mask: np.ndarray, template: np.ndarray, phase: float) -> None:
    """Let it learn a mask that is as likely without the shape prior."""
    shape.learn(mask, template, mask > 0, BODY, phase)


def test_it_is_ready_after_some_masks() -> None:
    shape = PersonalShape()
    for _ in range(4):
        shown(shape, block(35), NOTHING, 0.1)
    assert not shape.ready
    shown(shape, block(35), NOTHING, 0.1)
    assert shape.ready
    shape.reset()
    assert not shape.ready


def test_it_gives_back_what_no_template_has_wherever_the_body_stands() -> None:
    shape = PersonalShape()
    for _ in range(6):
        shown(shape, block(35), NOTHING, 0.1)
    same = shape.probability(NOTHING, BODY, 0.1)
    assert same[60, 50] == pytest.approx(1, abs=0.02)
    assert same[60, 20] == pytest.approx(0, abs=0.02)
    moved = shape.probability(NOTHING, BodyFrame(70, 60, 100), 0.1)
    assert moved[60, 80] == pytest.approx(1, abs=0.02)
    assert moved[60, 40] == pytest.approx(0, abs=0.02)


def test_what_the_template_has_too_follows_it_half_way() -> None:
    shape = PersonalShape()
    arm, bag = block(5), block(65)
    for _ in range(6):
        shown(shape, np.maximum(arm, bag), arm, 0.1)
    expected = shape.probability(block(35), BODY, 0.1)
    assert expected[60, 20] == pytest.approx(0.5, abs=0.02)
    assert expected[60, 50] == pytest.approx(0.5, abs=0.02)
    assert expected[60, 80] == pytest.approx(1, abs=0.02)


def test_what_a_template_has_too_much_is_taken_off() -> None:
    shape = PersonalShape()
    template = np.maximum(block(35), block(5))
    for _ in range(6):
        shown(shape, block(35), template, 0.1)
    expected = shape.probability(template, BODY, 0.1)
    assert expected[60, 50] == pytest.approx(1, abs=0.02)
    assert expected[60, 15] == pytest.approx(0, abs=0.02)


def test_what_only_the_shape_prior_puts_into_masks_or_keeps_out_is_not_learnt() -> None:
    shape = PersonalShape()
    body, kept, taken = block(35), block(5), block(65)
    for _ in range(6):
        likely = np.maximum(body, taken) > 0
        shape.learn(np.maximum(body, kept), np.maximum(body, taken), likely, BODY, 0.1)
    expected = shape.probability(np.maximum(body, taken), BODY, 0.1)
    assert expected[60, 50] == pytest.approx(1, abs=0.02)
    assert expected[60, 15] == pytest.approx(0, abs=0.02)
    assert expected[60, 80] == pytest.approx(1, abs=0.02)


def test_phases_are_remembered_apart() -> None:
    shape = PersonalShape()
    for _ in range(20):
        shown(shape, block(20), NOTHING, 0.0)
        shown(shape, block(50), NOTHING, 0.5)
    first = shape.probability(NOTHING, BODY, 0.0)
    second = shape.probability(NOTHING, BODY, 0.5)
    assert first[60, 30] > 0.8 > 0.3 > second[60, 30]
    assert second[60, 70] > 0.8 > 0.3 > first[60, 70]


def test_new_masks_outweigh_old_ones() -> None:
    shape = PersonalShape()
    for x in (20, 50):
        for _ in range(60):
            shown(shape, block(x), NOTHING, 0.0)
    # In the phase they were seen in, and in one that has never been.
    for phase in (0.0, 0.5):
        expected = shape.probability(NOTHING, BODY, phase)
        assert expected[60, 70] > 0.8 > 0.2 > expected[60, 30]


def test_phases_next_to_each_other_share_what_they_know() -> None:
    shape = PersonalShape()
    for _ in range(20):
        shown(shape, block(20), NOTHING, 0.99)
        shown(shape, block(50), NOTHING, 0.5)
    assert shape.probability(NOTHING, BODY, 0.01)[60, 30] > 0.8
    assert shape.probability(NOTHING, BODY, 0.25)[60, 30] < 0.7
