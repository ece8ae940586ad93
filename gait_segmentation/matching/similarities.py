# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The Tanimoto similarity of every template at every placement, as whole numbers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.kernels import kernel
from gait_segmentation.matching.builds import BuildKernels
from gait_segmentation.matching.placements import Sampled
from gait_segmentation.matching.search_range import SearchRange
from gait_segmentation.matching.tanimoto import WindowGrid, pitch_of, polyphase
from gait_segmentation.matching.transitions import UNIT
from gait_segmentation.matching.visibility import KnownLines, LineSums

__all__ = ['SimilarityMaps', 'filled_up']

_HUGE = 2**29
"""Area of a template that is out of sight: no likelihood can be like it."""


class SimilarityMaps:
    """
    Compares the likelihoods about a box with the templates of the builds that are searched.

    The Tanimoto similarity is C / (F + G - C), with C the common area of likelihood and template
    (their intersection), F the area of the likelihood and G that of the template.

    One build is done after the other: the common areas of one stay in the processor's cache until
    they have become similarities, half as large.
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
        Prepare the comparison.

        :param sums: of the kernels' templates.
        :param cost: (S,) int16 in path units, what each body height costs.
        :param minimum_visible: share of a template that must be known for it to count.
        """
        self._kernels, self._sums, self._windows, self._cost = kernels, sums, windows, cost
        self._whole = np.ascontiguousarray(sums.whole)
        self._least = (minimum_visible * self._whole).astype(np.int32)
        self._make_room(0)

    def update(
        self, sampled: Sampled, active: NDArray[np.bool_], searched: SearchRange
    ) -> NDArray[np.int16]:
        """
        Compare a frame.

        :param sampled: the likelihood about the box.
        :param active: (builds,) bool, which are searched; the rows of others are undefined.
        :param searched: the placements that are.
        :returns: (R, N) int16, similarities in path units less the cost of the body height, of
            the template of a row (see :class:`BuildKernels`) at each of the placements searched;
            what follows is undefined.  The next call overwrites it.
        """
        grid, heights = self._windows, searched.heights
        images = sampled.images[heights]
        known = None if sampled.known is None else sampled.known[heights]
        if self._maps.shape[1] != pitch_of(searched.size):
            self._make_room(searched.size)
        areas = grid.areas(images)[:, searched.rows, searched.columns]
        area = _line(areas, self._maps.shape[1])
        cost = _line(np.broadcast_to(self._cost[heights, None, None], areas.shape), len(area))
        windows = searched.first[1:], searched.shape
        planes = polyphase(images, grid)
        lines = None if known is None else KnownLines.of(known)
        masks = None if known is None or lines is not None else polyphase(known, grid)
        for build in np.flatnonzero(active).tolist():
            part = self._kernels.part(build)
            least, maps = self._least[part], self._maps[part]
            common = self._kernels.common_rows(planes, build, *windows, self._common)
            if lines is not None:
                sums = self._sums.over(lines.axis)[part]
                between = lines.spans, lines.axis == 1, grid.step, *windows
                _compare_between_lines(common, area, cost, maps, least, sums, *between)
            elif masks is not None:
                seen = self._kernels.common_rows(masks, build, *windows, self._seen)
                _compare_seen(common, area, cost, maps, least, seen)
            else:
                _compare(common, area, cost, maps, self._whole[part])
        return self._maps

    def _make_room(self, placements: int) -> None:
        """Make the memory to work in for a number of placements."""
        self._common = self._kernels.new_rows(placements)
        self._seen = self._kernels.new_rows(placements)
        self._maps = np.zeros((self._kernels.rows, pitch_of(placements)), np.int16)


def filled_up(values: NDArray[np.int16]) -> NDArray[np.int16]:
    """Return (R, n) values with rows as long as those of :meth:`SimilarityMaps.update`."""
    result = np.zeros((len(values), pitch_of(values.shape[1])), np.int16)
    result[:, : values.shape[1]] = values
    return result


def _line(values: NDArray[np.generic], pitch: int) -> NDArray[np.int32]:
    """Return values one after the other, followed by zeros."""
    result = np.zeros(pitch, np.int32)
    result[: values.size] = values.reshape(-1)
    return result


@kernel('i4[:,::1], i4[::1], i4[::1], i2[:,::1], i4[::1]')
def _compare(common, area, cost, maps, whole):  # type: ignore[no-untyped-def]
    """
    Put the similarities of a build into ``maps``, where all is known.

    :param common: (R, N) int32, C.
    :param area: (N,) int32, F.
    :param cost: (N,) int32, taken off.
    :param maps: (R, N) int16, result.
    :param whole: (R,) int32, G.
    """
    for row in range(len(common)):
        shared, g, result = common[row], whole[row], maps[row]
        for j in range(len(shared)):
            union = max(np.int32(area[j] + g - shared[j]), np.int32(1))
            share = np.float32(shared[j]) / np.float32(union)
            result[j] = np.int16(np.int32(share * np.float32(UNIT) + np.float32(0.5)) - cost[j])


@kernel('i4[:,::1], i4[::1], i4[::1], i2[:,::1], i4[::1], i4[:,::1]')
def _compare_seen(common, area, cost, maps, least, seen):  # type: ignore[no-untyped-def]
    """
    Do the same with areas G over the known pixels.

    :param least: (R,) int32, the least G for which a template counts.
    :param seen: (R, N) int32, G.
    """
    for row in range(len(common)):
        _compare_row(common[row], area, seen[row], least[row], cost, maps[row])


@kernel(
    'i4[:,::1], i4[::1], i4[::1], i2[:,::1], i4[::1], i4[:,::1], i8[:,::1], b1, i8, '
    'UniTuple(i8, 2), UniTuple(i8, 3)'
)
def _compare_between_lines(  # type: ignore[no-untyped-def]
    common, area, cost, maps, least, sums, spans, by_column, step, first, shape
):
    """
    Do the same where only rows or columns within a span are known.

    :param sums: (R, n) int32, running sums of the templates' lines.
    :param spans: (S, 2) int64, of each body height the first line of the padded image that is
        known, and the first after that is not.
    :param by_column: whether lines are columns.
    :param step: pixels from one window to the next.
    :param first: row and column of the first window, and ``shape`` (S, rows, columns) of them.
    """
    scales, rows, columns = shape
    lines, last = columns if by_column else rows, sums.shape[1] - 1
    begin = first[1] if by_column else first[0]
    bounds = np.empty((scales, lines, 2), np.int64)
    for scale in range(scales):
        for line in range(lines):
            edge = (begin + line) * step
            low = min(max(spans[scale, 0] - edge, 0), last)
            bounds[scale, line, 0] = low
            bounds[scale, line, 1] = min(max(spans[scale, 1] - edge, low), last)
    areas, seen = np.empty(lines, np.int32), np.zeros(common.shape[1], np.int32)
    for row in range(len(common)):
        for scale in range(scales):
            for line in range(lines):
                low, high = bounds[scale, line, 0], bounds[scale, line, 1]
                areas[line] = sums[row, high] - sums[row, low]
            if by_column:
                _repeat(areas, rows, seen[scale * rows * columns :])
            else:
                _stretch(areas, columns, seen[scale * rows * columns :])
        _compare_row(common[row], area, seen, least[row], cost, maps[row])


@kernel()
def _compare_row(shared, area, seen, least, cost, result):  # type: ignore[no-untyped-def]
    for j in range(len(shared)):
        # A template out of sight gets an area that no likelihood can be like.
        g = seen[j]
        if g < least:
            g = np.int32(_HUGE)
        union = max(np.int32(area[j] + g - shared[j]), np.int32(1))
        share = np.float32(shared[j]) / np.float32(union)
        result[j] = np.int16(np.int32(share * np.float32(UNIT) + np.float32(0.5)) - cost[j])


@kernel()
def _stretch(values, times, result):  # type: ignore[no-untyped-def]
    """Put each value into ``result`` a number of times."""
    for k in range(len(values)):
        value, first = values[k], k * times
        for x in range(times):
            result[first + x] = value


@kernel()
def _repeat(values, times, result):  # type: ignore[no-untyped-def]
    """Put all values into ``result`` a number of times."""
    for k in range(times):
        first = k * len(values)
        for x in range(len(values)):
            result[first + x] = values[x]
