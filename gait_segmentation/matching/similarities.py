# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The Tanimoto similarity of every template at every placement, as whole numbers."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.matching.builds import BuildKernels
from gait_segmentation.matching.placements import EVERY_HEIGHT, Sampled
from gait_segmentation.matching.tanimoto import WindowGrid, polyphase
from gait_segmentation.matching.transitions import UNIT
from gait_segmentation.matching.visibility import KnownLines, LineSums

__all__ = ['SimilarityMaps']

_HUGE = 2**29
"""Area of a template that is out of sight: no likelihood can be like it."""


class SimilarityMaps:
    """
    Compares the likelihoods about a box with the templates of the builds that are searched.

    One body height and build is done after the other: the common areas of one stay in the
    processor's cache until they have become similarities, half as large.
    """

    def __init__(
        self,
        kernels: BuildKernels,
        sums: LineSums,
        windows: WindowGrid,
        cost: NDArray[np.int16],
        minimum_visible: float,
    ) -> None:
        """
        Prepare the memory to work in.

        :param sums: of the kernels' templates.
        :param cost: (S,), what each body height costs.
        :param minimum_visible: share of a template that must be known for it to count.
        """
        self._kernels, self._sums, self._windows, self._cost = kernels, sums, windows, cost
        self._whole = np.ascontiguousarray(sums.whole)
        self._least = (minimum_visible * self._whole).astype(np.int32)
        self._common, self._seen = kernels.new_rows(), kernels.new_rows()
        self._maps = np.zeros((kernels.rows, len(cost) * kernels.pitch), np.int16)

    def update(
        self, sampled: Sampled, active: NDArray[np.bool_], searched: slice = EVERY_HEIGHT
    ) -> NDArray[np.int16]:
        """
        Compare a frame.

        :param sampled: the likelihood about the box.
        :param active: (builds,) bool, which are searched; the rows of others are undefined.
        :param searched: the body heights that are; the placements of others are undefined.
        :returns: (R, N) int16, similarities in path units less the cost of the body height, of
            the template of a row (see :class:`BuildKernels`) at N = S * pitch placements, the
            windows of each body height filled up.  The next call overwrites it.
        """
        grid = self._windows
        images, known = sampled.images[searched], sampled.known
        heights = range(len(sampled.images))[searched]
        areas = np.zeros((len(images), self._kernels.pitch), np.int32)
        areas[:, : grid.rows * grid.columns] = grid.areas(images).reshape(len(areas), -1)
        planes = polyphase(images, grid)
        lines = None if known is None else KnownLines.of(known)
        masks = None if known is None or lines is not None else polyphase(known, grid)
        for build in np.flatnonzero(active).tolist():
            part = self._kernels.part(build)
            whole, least, maps = self._whole[part], self._least[part], self._maps[part]
            for index, scale in enumerate(heights):
                common = self._kernels.common_rows(planes[index], build, self._common)
                frame = common, areas[index], self._cost[scale], scale, maps
                if lines is not None:
                    sums, span = self._sums.over(lines.axis)[part], lines.spans[scale]
                    shape = grid.rows, grid.columns, grid.step
                    _compare_between_lines(*frame, least, sums, span, lines.axis == 1, shape)
                elif masks is not None:
                    seen = self._kernels.common_rows(masks[scale], build, self._seen)
                    _compare_seen(*frame, least, seen)
                else:
                    _compare(*frame, whole)
        return self._maps


@njit(cache=True, nogil=True)
def _compare(common, area, cost, scale, maps, whole):  # type: ignore[no-untyped-def]
    """
    Put the similarities of one body height into ``maps``, where all is known.

    :param common: (R, L) int32, C.
    :param area: (L,) int32, F.
    :param cost: int16, taken off.
    :param maps: (R, S * L) int16, result, of which L columns are this body height's.
    :param whole: (R,) int32, G.
    """
    lanes = common.shape[1]
    for row in range(len(common)):
        shared, g = common[row], whole[row]
        result = maps[row, scale * lanes : (scale + 1) * lanes]
        for j in range(lanes):
            joint = max(np.int32(area[j] + g - shared[j]), np.int32(1))
            share = np.float32(shared[j]) / np.float32(joint)
            result[j] = np.int16(np.int32(share * np.float32(UNIT) + np.float32(0.5)) - cost)


@njit(cache=True, nogil=True)
def _compare_seen(common, area, cost, scale, maps, least, seen):  # type: ignore[no-untyped-def]
    """
    Do the same with areas G over the known pixels.

    :param least: (R,) int32, the least G for which a template counts.
    :param seen: (R, L) int32, G.
    """
    lanes = common.shape[1]
    for row in range(len(common)):
        result = maps[row, scale * lanes : (scale + 1) * lanes]
        _compare_row(common[row], area, seen[row], least[row], cost, result)


@njit(cache=True, nogil=True)
def _compare_between_lines(  # type: ignore[no-untyped-def]
    common, area, cost, scale, maps, least, sums, span, by_column, shape
):
    """
    Do the same where only rows or columns within a span are known.

    :param sums: (R, n) int32, running sums of the templates' lines.
    :param span: (2,) int64, the first line of the padded image that is known, and the first
        after that is not.
    :param by_column: whether lines are columns.
    :param shape: rows, columns and step of the windows.
    """
    lanes = common.shape[1]
    rows, columns, step = shape
    lines, last = columns if by_column else rows, sums.shape[1] - 1
    low, high = np.empty(lines, np.int64), np.empty(lines, np.int64)
    for line in range(lines):
        low[line] = min(max(span[0] - line * step, 0), last)
        high[line] = min(max(span[1] - line * step, low[line]), last)
    areas, seen = np.empty(lines, np.int32), np.zeros(lanes, np.int32)
    for row in range(len(common)):
        for line in range(lines):
            areas[line] = sums[row, high[line]] - sums[row, low[line]]
        if by_column:
            _repeat(areas, rows, seen)
        else:
            _stretch(areas, columns, seen)
        result = maps[row, scale * lanes : (scale + 1) * lanes]
        _compare_row(common[row], area, seen, least[row], cost, result)


@njit(cache=True, nogil=True)
def _compare_row(shared, area, seen, least, cost, result):  # type: ignore[no-untyped-def]
    for j in range(len(shared)):
        # A template out of sight gets an area that no likelihood can be like.
        g = seen[j]
        if g < least:
            g = np.int32(_HUGE)
        joint = max(np.int32(area[j] + g - shared[j]), np.int32(1))
        share = np.float32(shared[j]) / np.float32(joint)
        result[j] = np.int16(np.int32(share * np.float32(UNIT) + np.float32(0.5)) - cost)


@njit(cache=True, nogil=True)
def _stretch(values, times, result):  # type: ignore[no-untyped-def]
    """Put each value into ``result`` a number of times."""
    for k in range(len(values)):
        value, first = values[k], k * times
        for x in range(times):
            result[first + x] = value


@njit(cache=True, nogil=True)
def _repeat(values, times, result):  # type: ignore[no-untyped-def]
    """Put all values into ``result`` a number of times."""
    for k in range(times):
        first = k * len(values)
        for x in range(len(values)):
            result[first + x] = values[x]
