# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from gait_segmentation.starting.shapes import Probation


def bar(share: float) -> np.ndarray:
    """Return a mask whose similarity to the whole bar is its share."""
    mask = np.zeros((100, 10), np.uint8)
    mask[: round(100 * share)] = 255
    return mask


@pytest.mark.parametrize(
    ('fits', 'evidence', 'passed'),
    [
        ([0.8, 0.7], 0.0, True),
        ([0.6, 0.6], 1.0, False),
        ([0.6, 0.6], 5.0, True),
        ([0.9, 0.0], 1.0, False),
        ([], 0.0, True),
    ],
)
def test_masks_must_fit_their_templates_the_less_the_more_evidence_there_is(
    fits: list[float], evidence: float, passed: bool
) -> None:
    probation = Probation(10**9)
    for share in fits:
        probation.add_mask(10**9, bar(share), bar(1.0))
    probation.see(evidence)
    probation.see(0.0)
    assert probation.is_passed(2 * 10**9) == passed


def leg(forward: int) -> np.ndarray:
    """Return a mask, (h, w) uint8, of a leg that stands and one that is so far from it."""
    mask = np.zeros((60, 60), np.uint8)
    mask[:30, 20:40] = mask[30:, 20:25] = mask[30:, 20 + forward : 25 + forward] = 255
    return mask


@pytest.mark.parametrize(
    ('masks', 'later_s', 'passed'),
    [
        ([leg(15)] * 10, 0.1, False),
        ([leg(3 * k) for k in (0, 1, 2, 3, 4, 5, 4, 3, 2, 1)], 0.1, True),
        # Only shapes half a step apart are compared.
        ([leg(15)] * 2, 0.2, True),
        ([leg(15)] * 2, 0.9, True),
    ],
)
def test_who_walks_changes_shape(masks: list[np.ndarray], later_s: float, passed: bool) -> None:
    probation = Probation(10**9)
    for number, mask in enumerate(masks):
        probation.add_mask(10**9 + round(number * later_s * 1e9), mask, mask)
    assert probation.is_passed(2 * 10**9) == passed


def test_masks_tell_after_a_second_and_it_is_over_after_three() -> None:
    probation = Probation(10**9)
    probation.add_mask(10**9, bar(0.3), bar(1.0))
    assert probation.is_passed(2 * 10**9 - 1)
    assert not probation.is_passed(2 * 10**9)
    assert not probation.is_over(4 * 10**9 - 1)
    assert probation.is_over(4 * 10**9)
