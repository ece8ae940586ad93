# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Who is taken for a person a second after being found."""

from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.tracking.trial import Trial


def fitting(share: float) -> tuple[np.ndarray, np.ndarray]:
    """Return a mask and a template with such a similarity."""
    template = np.zeros((100, 10), np.uint8)
    mask = template.copy()
    template[:] = 255
    mask[: round(100 * share)] = 255
    return mask, template


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
    trial = Trial(10**9)
    for share in fits:
        trial.learn(10**9, *fitting(share))
    trial.see(evidence)
    trial.see(0.0)
    assert trial.is_passed() == passed


def leg(forward: int) -> np.ndarray:
    """Return a mask, (h, w) uint8, of a leg that stands and one that is so far from it."""
    mask = np.zeros((60, 60), np.uint8)
    mask[:30, 20:40] = mask[30:, 20:25] = mask[30:, 20 + forward : 25 + forward] = 255
    return mask


@pytest.mark.parametrize(
    ('masks', 'passed'),
    [
        ([leg(15)] * 10, False),
        ([leg(3 * k) for k in (0, 1, 2, 3, 4, 5, 4, 3, 2, 1)], True),
        ([leg(0).T if k % 4 < 2 else leg(0) for k in range(10)], False),
    ],
)
def test_who_walks_changes_shape_and_stays_a_body(masks: list[np.ndarray], passed: bool) -> None:
    trial = Trial(10**9)
    for number, mask in enumerate(masks):
        trial.learn(10**9 + number * 10**8, mask, mask)
    assert trial.is_passed() == passed


def test_it_lasts_a_second() -> None:
    trial = Trial(10**9)
    assert not trial.is_over(2 * 10**9 - 1)
    assert trial.is_over(2 * 10**9)
