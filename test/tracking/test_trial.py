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
        trial.learn(*fitting(share))
    trial.see(evidence)
    trial.see(0.0)
    assert trial.is_passed() == passed


def test_it_lasts_a_second() -> None:
    trial = Trial(10**9)
    assert not trial.is_over(2 * 10**9 - 1)
    assert trial.is_over(2 * 10**9)
