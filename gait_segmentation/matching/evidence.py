# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How well the phases of one sequence fit a likelihood: squared differences, pixel by pixel."""

from __future__ import annotations

from copy import copy

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ['SequenceEvidence']

_LEAST_CONTRAST = 0.05
_REACH = 1  # pixels by which the place is varied


_SHARES = 8  # steps in which views are blended

_Blend = tuple[NDArray[np.float32], NDArray[np.float64], tuple[slice, slice]]
"""The used part of blended templates in 0..1, (P, h, w), the sums of its squares, and the part."""


class SequenceEvidence:
    """
    Compares the phases of a sequence at one place.

    The Tanimoto similarity favours large templates where the surroundings are not black, and
    stores only how much is alike; differences as small as those between the phases of a walker
    seen from the front drown in that.  Here the likelihood is scaled so that the person is 1 and
    the surroundings 0 on average, and compared by half the sum of squared differences, which is
    the logarithm of the probability for independent errors of the pixels.
    """

    def __init__(self, templates: NDArray[np.uint8]) -> None:
        """
        Keep the templates.

        :param templates: (V, P, H, W) uint8.
        """
        self._templates = templates
        self._kept: tuple[tuple[int, int, int], _Blend] | None = None
        used = np.asarray(templates).max(axis=1) > 0
        rows, columns = used.max(axis=2), used.max(axis=1)
        self._parts = [(_span(rows[v]), _span(columns[v])) for v in range(len(templates))]

    def copy(self) -> SequenceEvidence:
        """Return one of the same templates that has compared nothing."""
        other = copy(self)
        other._kept = None
        return other

    def at(
        self,
        image: NDArray[np.uint8],
        known: NDArray[np.uint8] | None,
        place: tuple[int, int],
        sequence: int,
        phase: int,
        beside: tuple[int, float] | None = None,
    ) -> NDArray[np.float64]:
        """
        Compare all phases of a sequence.

        :param image: (h, w) uint8 likelihood on the pixel grid of the templates, larger than one.
        :param known: (h, w) uint8, 0 where the likelihood says nothing; None = known everywhere.
        :param place: row and column of the templates' upper left corner.
        :param sequence: the sequence.
        :param phase: one that fits, by which person and surroundings are told apart.
        :param beside: a neighbouring view and its share in 0..1: the templates are blended, for
            directions between two views.
        :returns: (P,) float64, up to a constant half the sum of squared differences, negative;
            the best of the places one pixel about.  Zeros if nothing can be told.
        """
        _, _, height, width = self._templates.shape
        template = self._templates[sequence, phase].astype(np.float32) / 255
        nothing = np.zeros(self._templates.shape[1])
        first_row, first_column = max(place[0] - _REACH, 0), max(place[1] - _REACH, 0)
        about = (
            slice(first_row, place[0] + height + _REACH),
            slice(first_column, place[1] + width + _REACH),
        )
        row, column = place[0] - first_row, place[1] - first_column
        values = image[about].astype(np.float32) / 255
        seen = np.ones_like(values) if known is None else (known[about] != 0).astype(np.float32)
        here = (slice(row, row + height), slice(column, column + width))
        inside = template * seen[here]
        area = float(inside.sum())
        around = float(seen[here].sum()) - area
        if area < 1 or around < 1:
            return nothing
        common = float((values[here] * inside).sum())
        person = common / area
        ground = (float((values[here] * seen[here]).sum()) - common) / around
        if person - ground < _LEAST_CONTRAST:
            return nothing
        scaled = seen * (values - ground) / (person - ground)
        other, share = (sequence, 0.0) if beside is None else beside
        flat, own, (rows, columns) = self._blended(sequence, other, round(_SHARES * share))
        result = np.empty(len(flat))
        _compare(
            flat,
            own,
            scaled.astype(np.float32),
            seen,
            known is None,
            row + rows.start,
            column + columns.start,
            result,
        )
        return result

    def _blended(self, sequence: int, other: int, share: int) -> _Blend:
        """Return templates blended from two views, by ``share`` parts of the other one."""
        key = sequence, other, share
        if self._kept is None or self._kept[0] != key:
            parts = self._parts[sequence], self._parts[other]
            rows, columns = (_around(first, second) for first, second in zip(*parts, strict=True))
            own, beside = (
                self._templates[view][:, rows, columns].astype(np.float32) / 255
                for view in (sequence, other)
            )
            flat = np.ascontiguousarray(own + np.float32(share / _SHARES) * (beside - own))
            squares = (flat.astype(np.float64) ** 2).sum(axis=(1, 2))
            self._kept = key, (flat, squares, (rows, columns))
        return self._kept[1]


@njit(cache=True, nogil=True, fastmath=True)
def _compare(templates, own, scaled, seen, all_seen, top, left, result):  # type: ignore[no-untyped-def]
    """
    Put minus half the least sum of squared differences of each template into ``result``.

    Not by matrix products: those of BLAS wait for each other's threads where cores are busy.

    :param templates: (P, h, w) float32, and ``own`` (P,) float64 the sums of their squares.
    :param scaled: (H, W) float32, the likelihood; ``seen`` likewise, 1 where it is known.
    :param top: where the templates lie on it; ``left`` likewise.
    """
    height, width = templates.shape[1:]
    lines = templates.reshape(len(templates), -1)
    values = np.empty(lines.shape[1], np.float32)
    shown = np.empty(lines.shape[1], np.float32)
    result[:] = -np.inf
    for y in range(max(top - _REACH, 0), min(top + _REACH, len(scaled) - height) + 1):
        for x in range(max(left - _REACH, 0), min(left + _REACH, scaled.shape[1] - width) + 1):
            for row in range(height):
                for column in range(width):
                    values[row * width + column] = scaled[y + row, x + column]
                    shown[row * width + column] = seen[y + row, x + column]
            for phase in range(len(lines)):
                line = lines[phase]
                alike = np.float32(0)
                for j in range(len(line)):
                    alike += line[j] * values[j]
                squares = own[phase]
                if not all_seen:
                    total = np.float32(0)
                    for j in range(len(line)):
                        total += line[j] * line[j] * shown[j]
                    squares = np.float64(total)
                result[phase] = max(result[phase], alike - 0.5 * squares)


def _span(used: NDArray[np.bool_]) -> slice:
    """Return the part of an axis that is used, at least one element."""
    found = np.flatnonzero(used)
    return slice(int(found[0]), int(found[-1]) + 1) if len(found) else slice(0, 1)


def _around(first: slice, second: slice) -> slice:
    """Return the span of both."""
    return slice(min(first.start, second.start), max(first.stop, second.stop))
