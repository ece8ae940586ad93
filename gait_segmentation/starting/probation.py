# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether what was found without a box is a person, by its first seconds."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import tanimoto
from gait_segmentation.starting.blobs import normalised_mask

_RIPE_NS, _PROBATION_NS = 1_000_000_000, 3_000_000_000
"""Time after which the masks tell whether it is a person, and in which people do not vanish."""

_LEAST_FIT = 0.68
"""Mean similarity of the masks with their templates that proves a person by itself."""

_WORTH, _MOST_EVIDENCE = 0.02, 10.0
"""Similarity that may be missing for each time the evidence that people are found at; at most."""

_STEP_NS = 300_000_000, 450_000_000
"""Time in which who walks takes on another shape: about half a step."""

_RIGID, _ODD = 0.7, 2.0
"""
Similarity of two masks so far apart, in the mean, from which it is of something rigid, and how
many times more counts against a person.
"""


class Probation:
    """
    The evidence that what was found by its walk is a person.

    The shape of a blob let them be found; now their masks must have the shape of the templates
    that were matched, the less so the longer the search goes on to take the blob for a body.
    """

    def __init__(self, stamp_ns: int) -> None:
        """Begin when it is found."""
        self._begin_ns = stamp_ns
        self._passed = False
        self._evidence = 0.0
        self._fits: list[float] = []
        self._shapes: list[tuple[int, NDArray[np.uint8]]] = []
        self._changes: list[float] = []

    def see(self, evidence: float) -> None:
        """Take in what the search says by now, in times of what it finds people at."""
        self._evidence = min(max(self._evidence, evidence), _MOST_EVIDENCE)

    def add_mask(
        self, stamp_ns: int, mask: NDArray[np.uint8], template: NDArray[np.uint8]
    ) -> None:
        """Take in a mask, 0/255, and its template, (h, w) uint8, and the stamp of their frame."""
        self._fits.append(float(tanimoto(mask, template)))
        shape = normalised_mask(mask)
        if shape is None:
            return
        least, most = _STEP_NS
        for then, earlier in self._shapes:
            if least <= stamp_ns - then <= most:
                self._changes.append(float(tanimoto(earlier, shape)))
        self._shapes.append((stamp_ns, shape))

    def is_over(self, stamp_ns: int) -> bool:
        """Return whether there is nothing left to decide."""
        return stamp_ns >= self._begin_ns + _PROBATION_NS

    def is_passed(self, stamp_ns: int) -> bool:
        """Return whether it may be a person, as the masks tell, once, after the first second."""
        if not self._passed and stamp_ns >= self._begin_ns + _RIPE_NS:
            self._passed = self._is_body()
            return self._passed
        return True

    def _is_body(self) -> bool:
        """Return whether it is a person as far as is known; without a mask nothing is."""
        if not self._fits:
            return True
        fit = float(np.mean(self._fits)) + _WORTH * self._evidence
        if self._changes:
            fit -= _ODD * max(float(np.mean(self._changes)) - _RIGID, 0.0)
        return fit >= _LEAST_FIT
