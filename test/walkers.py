# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Short synthetic clips that tests of several stages share."""

from __future__ import annotations

from functools import cache

import numpy as np

from gait_segmentation.evaluation.synthetic import (
    SyntheticConfig,
    SyntheticFrame,
    SyntheticSequence,
)
from gait_segmentation.gait_model import BankSpec, TemplateBank, build_bank


@cache
def small_bank() -> TemplateBank:
    """Return a bank of 8 directions and 12 phases, enough for tests and quickly built."""
    return build_bank(BankSpec(azimuths=8, phases=12, builds='average'))


@cache
def clip(pan: float = 2.0, frames: int = 16, seed: int = 3) -> tuple[SyntheticFrame, ...]:
    """Return a walk to the right before a cluttered, panned background."""
    config = SyntheticConfig(seed=seed, frames=frames, pan=pan, person_height=110.0)
    return tuple(SyntheticSequence(config))


def overlap(mask: np.ndarray, truth: np.ndarray) -> float:
    """Return J without the ambiguous pixels."""
    sure = (truth == 0) | (truth == 255)
    found, true = (mask > 0) & sure, truth == 255
    return float((found & true).sum() / max((found | true)[sure].sum(), 1))
