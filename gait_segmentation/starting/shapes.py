# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The shape of a body: how much a region has of it, and whether a new track keeps it."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.images import bounding_box, tanimoto

_SHAPE_ROWS = 24  # height in pixels at which regions are compared with templates
# Time after which the masks tell whether it is a person, and in which people do not vanish.
_RIPE_NS = 1_000_000_000
_PROBATION_NS = 3_000_000_000
_LEAST_FIT = 0.68  # mean similarity of masks with their templates that proves a person by itself
# Similarity that may be missing for each time the evidence that people are found at; at most.
_WORTH = 0.02
_MOST_EVIDENCE = 10.0
_HALF_STEP_NS = 300_000_000, 450_000_000  # time in which who walks takes on another shape
# Similarity of two masks so far apart, in the mean, from which it is of something rigid, and how
# many times more counts against a person.
_RIGID = 0.7
_ODD = 2.0


class BodyShapes:
    """Templates of a bank, every other phase and view, tight about the body and small."""

    def __init__(self, bank: TemplateBank) -> None:
        rows = bank.templates.shape[2]
        top, bottom = round(rows * (1 - bank.fill) / 2), round(rows * (1 + bank.fill) / 2)
        chosen = bank.templates[::2, ::2].reshape(-1, *bank.templates.shape[2:])
        # A template is never wider than twice its height.
        shapes = [normalised(template[top:bottom]) for template in chosen]
        self._shapes = np.stack([shape for shape in shapes if shape is not None])

    def likeness(self, shape: NDArray[np.uint8] | None) -> float:
        """Return the similarity of a normalised shape with the template most like it, 0 to 1."""
        return 0.0 if shape is None else float(tanimoto(self._shapes, shape).max())


def normalised(region: NDArray[np.uint8], aspect: float | None = None) -> NDArray[np.uint8] | None:
    """
    Return a tight region at a size of 24 x 48, its centre of mass in the middle.

    :param region: (h, w) uint8, 255 inside.
    :param aspect: its width over its height, if its pixels are not square.
    :returns: (24, 48) uint8, None of what is wider than that.
    """
    height, width = region.shape
    columns = max(1, round(_SHAPE_ROWS * (width / height if aspect is None else aspect)))
    if columns > 2 * _SHAPE_ROWS:
        return None
    small = np.asarray(cv2.resize(region, (columns, _SHAPE_ROWS), interpolation=cv2.INTER_AREA))
    mass = small.sum(axis=0, dtype=np.float64)
    middle = int(np.rint((mass @ np.arange(columns)) / max(mass.sum(), 1.0)))
    out = np.zeros((_SHAPE_ROWS, 2 * _SHAPE_ROWS), np.uint8)
    left = _SHAPE_ROWS - middle
    first, last = max(left, 0), min(left + columns, 2 * _SHAPE_ROWS)
    out[:, first:last] = small[:, first - left : last - left]
    return out


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
        x, y, width, height = bounding_box(mask)
        shape = normalised(mask[y : y + height, x : x + width]) if height else None
        if shape is None:
            return
        least, most = _HALF_STEP_NS
        for then, earlier in self._shapes:
            if least <= stamp_ns - then <= most:
                self._changes.append(float(tanimoto(earlier, shape)))
        self._shapes.append((stamp_ns, shape))

    def is_over(self, stamp_ns: int) -> bool:
        """Return whether there is nothing left to decide."""
        return stamp_ns >= self._begin_ns + _PROBATION_NS

    def is_passed(self, stamp_ns: int) -> bool:
        """Return whether it may be a person, as the masks tell, once, after the first second."""
        if self._passed or stamp_ns < self._begin_ns + _RIPE_NS:
            return True
        fit = _LEAST_FIT  # without a mask nothing speaks against them
        if self._fits:
            fit = float(np.mean(self._fits)) + _WORTH * self._evidence
        if self._changes:
            fit -= _ODD * max(float(np.mean(self._changes)) - _RIGID, 0.0)
        self._passed = fit >= _LEAST_FIT
        return self._passed
