# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Pairs drawn for RANSAC: the same in every run."""

from __future__ import annotations

import numpy as np
from numba import njit

__all__ = ['FIRST', 'pair_of']

FIRST = np.uint32(1)
"""State to begin with."""


@njit(nogil=True, inline='always')
def _next(state: np.uint32) -> np.uint32:
    """Return the next state of a linear congruential generator (Numerical Recipes)."""
    return np.uint32(state * np.uint32(1664525) + np.uint32(1013904223))


@njit(nogil=True, inline='always')
def pair_of(count: int, state: np.uint32) -> tuple[int, int, np.uint32]:
    """Return the numbers of two of some things, which may be the same, and the next state."""
    one = _next(state)
    two = _next(one)
    return int(one >> np.uint32(8)) % count, int(two >> np.uint32(8)) % count, two
