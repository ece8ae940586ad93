# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether somebody found without a box is a person, as their first second tells."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.starting.finding.shapes import tanimoto

__all__ = ['Trial']

_TRIAL_NS = 1_000_000_000

_LEAST_FIT = 0.68
"""Mean similarity of the masks with their templates that proves a person by itself."""

_WORTH = 0.02
"""Similarity that may be missing for each time the evidence that somebody is found at."""


class Trial:
    """
    What speaks for somebody found by the walk to be a person.

    The shape of a blob let them be found; now their masks must have the shape of the templates
    that were matched, the less so the longer the search goes on to take the blob for a body.
    """

    def __init__(self, stamp_ns: int) -> None:
        """Begin when somebody is found."""
        self._end_ns = stamp_ns + _TRIAL_NS
        self._evidence = self._fit = 0.0
        self._masks = 0

    def see(self, evidence: float) -> None:
        """Take in what the search says by now, in times of what it finds people at."""
        self._evidence = max(self._evidence, evidence)

    def learn(self, mask: NDArray[np.uint8], template: NDArray[np.uint8]) -> None:
        """Take in a mask and its template, (h, w) uint8."""
        self._fit += float(tanimoto(mask, template))
        self._masks += 1

    def is_over(self, stamp_ns: int) -> bool:
        """Return whether it is to be decided."""
        return stamp_ns >= self._end_ns

    def is_passed(self) -> bool:
        """Return whether it is a person as far as is known; without a mask nothing is."""
        fit = self._fit / max(self._masks, 1)
        return self._masks == 0 or fit + _WORTH * self._evidence >= _LEAST_FIT
