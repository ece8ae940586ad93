# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
How similar all templates are to the likelihood, at all placements searched.

Also the common areas this is made of: what kernels share, and the paper's kernel.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.kernels import kernel
from gait_segmentation.matching.placements import Sampled, SearchRange, WindowGrid

UNIT = 2048
"""Whole numbers that a similarity of 1 is in path scores."""

Images = NDArray[np.uint8]


class CommonAreas(ABC):
    """
    Computes C = sum of min(likelihood, template) for all templates and windows.

    Equal templates, such as the half-cycle twins of a profile, share a row: there are ``rows``;
    ``row`` (K,) int32 is that of each template, and ``area`` (R,) int32 the sums G over them.
    Nothing is written after making, so that matchers may share a kernel.
    """

    def __init__(self, templates: Images, grid: WindowGrid) -> None:
        """Code (K, height, width) uint8 templates; the fewer grey levels, the faster."""
        self._grid = grid
        pixels = np.ascontiguousarray(templates.reshape(len(templates), -1))
        different, first, row = np.unique(
            pixels.view(np.dtype((np.void, pixels.shape[1]))),
            return_index=True,
            return_inverse=True,
        )
        self.rows = len(different)
        place = self._code(pixels[first])
        self.row: NDArray[np.int32] = place[row.reshape(-1)]
        self.area = np.empty(self.rows, np.int32)
        self.area[self.row] = pixels.sum(axis=1)

    @abstractmethod
    def _code(self, templates: Images) -> NDArray[np.int32]:
        """Prepare (R, height x width) uint8, all different; return the row of each, (R,) int32."""

    @abstractmethod
    def common_rows(
        self, images: Images, searched: SearchRange, matrix: Images, out: NDArray[np.int32]
    ) -> NDArray[np.int32]:
        """
        Return C for some of the windows.

        :param images: (S, *grid.image_shape) uint8, contiguous, of the body heights searched.
        :param searched: the windows.
        :param matrix: from :meth:`new_matrix`, and ``out`` from :meth:`new_rows`, to work in.
        :returns: (R, N) int32, a view of ``out``, C of template k in row ``row[k]``, lane by
            lane; what follows, up to ``searched.pitch`` of them, is undefined.
        """

    def new_matrix(self) -> Images:
        """Return an array for ``matrix`` of :meth:`common_rows`, empty if none is needed."""
        return np.zeros(0, np.uint8)

    def new_rows(self, pitch: int) -> NDArray[np.int32]:
        """Return an array for ``out`` of :meth:`common_rows`; its first row must stay zero."""
        return np.zeros((self.rows + 1, pitch), np.int32)


class SimilarityMaps:
    """
    Compares the likelihoods about a box with all templates of a bank.

    The Tanimoto similarity is C / (F + G - C), with C the common area of likelihood and template
    (their intersection), F the area of the likelihood and G that of the template.
    """

    def __init__(self, coded: CommonAreas, windows: WindowGrid, cost: NDArray[np.int16]) -> None:
        """Compare on windows as they were coded; ``cost`` (S,) int16 is that of body heights."""
        self._coded, self._windows, self._cost = coded, windows, cost
        self._matrix = coded.new_matrix()
        self._maps = np.zeros((coded.rows, 0), np.int16)

    def compare(self, sampled: Sampled, searched: SearchRange) -> NDArray[np.int16]:
        """
        Compare a frame.

        :returns: (R, N) int16, similarities in path units less the cost of the body height, of
            the template of a row at each of the placements searched; what follows is undefined.
            The next call overwrites it.
        """
        heights, rows, columns = searched.slices
        coded, pitch = self._coded, searched.pitch
        images = sampled.images[heights]
        if self._maps.shape[1] != pitch:
            self._common, self._seen = coded.new_rows(pitch), coded.new_rows(pitch)
            self._maps = np.zeros((coded.rows, pitch), np.int16)
        areas = self._windows.areas(images)[:, rows, columns]
        # One line for all placements, filled up with zeros.
        area, cost = np.zeros((2, pitch), np.int32)
        area[: areas.size] = areas.reshape(-1)
        cost[: areas.size] = np.repeat(self._cost[heights], areas[0].size)
        common = coded.common_rows(images, searched, self._matrix, self._common)
        seen = coded.area[:, None]
        if sampled.known is not None:
            # Of known pixels, G is the common area with a likelihood that is white there.
            known = sampled.known[heights]
            seen = coded.common_rows(known, searched, self._matrix, self._seen)
        _compare(common, area, cost, self._maps, seen)
        return self._maps


@kernel('i4[:,::1], i4[::1], i4[::1], i2[:,::1], i4[:,::1]')
def _compare(common, area, cost, maps, seen):  # type: ignore[no-untyped-def]
    """Put similarities into ``maps`` by C, F, costs, and G of what is known: (R, N) or (R, 1)."""
    line = np.empty(common.shape[1], np.int32)
    for row in range(len(common)):
        areas = seen[row]
        if len(areas) == 1:
            line[:] = areas[0]
            areas = line
        _compare_row(common[row], area, areas, cost, maps[row])


@kernel()
def _compare_row(shared, area, seen, cost, result):  # type: ignore[no-untyped-def]
    for j in range(len(shared)):
        union = max(np.int32(area[j] + seen[j] - shared[j]), np.int32(1))
        share = np.float32(shared[j]) / np.float32(union)
        result[j] = np.int16(np.int32(share * np.float32(UNIT) + np.float32(0.5)) - cost[j])


class DirectAccessTableKernel(CommonAreas):
    """
    The sorted direct access tables of the paper.

    The templates' values at a pixel are sorted once.  For each value v that the likelihood can
    have there, a table gives how many templates are not above v: these add their own value to
    their sums, all others add v, and nothing is compared while matching.  Either those that are
    not black are gone through, or all get v by one addition, and those that are not above v give
    back the rest: whichever are fewer.  So a pixel costs nothing where all templates are alike,
    but where their outlines are, the time grows with their number.

    Wang, Yagi and Makihara, ACCV 2009, section 3.  The paper has two splitting IDs, of which one
    is enough: see :func:`splitting_ids`.
    """

    def _code(self, templates: Images) -> NDArray[np.int32]:
        used = np.flatnonzero(templates.any(axis=0))
        order = np.argsort(templates[:, used], axis=0, kind='stable')
        values = np.take_along_axis(templates[:, used], order, axis=0)
        self._order = np.ascontiguousarray(order.T.astype(np.uint32))
        self._values = np.ascontiguousarray(values.T)
        self._split = splitting_ids(self._values)[1]
        self.pixels = np.column_stack(np.divmod(used, self._grid.width)).astype(np.int64)
        return np.arange(len(templates), dtype=np.int32)

    @property
    def changed(self) -> NDArray[np.int32]:
        """Return how many templates each pixel of each value changes, (pixels, 256)."""
        return np.minimum(self._split, len(self._order[0]) - self._split[:, :1])

    def common_rows(
        self, images: Images, searched: SearchRange, matrix: Images, out: NDArray[np.int32]
    ) -> NDArray[np.int32]:
        """Add up what the tables say, pixel by pixel."""
        step = self._grid.step
        corner = searched.first[1] * step, searched.first[2] * step
        coded = self.pixels, self._order, self._values, self._split
        _add_up(images, *coded, corner, step, searched.shape, out)
        return out[1:]


def splitting_ids(values: NDArray[np.uint8]) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """
    Return both splitting IDs for every pixel and value v.

    The templates between them are those whose value is v.  There a template's own value and v
    are the same number, so that any split from the first ID to the second gives the same sums.

    :param values: (pixels, K) uint8, ascending in each row.
    :returns: the number of templates below v, and of those not above it; (pixels, 256) int32.
    """
    count = np.zeros((len(values), 257), np.int32)
    np.add.at(count, (np.arange(len(values))[:, None], values.astype(np.intp) + 1), 1)
    below = np.cumsum(count, axis=1, dtype=np.int32)
    return np.ascontiguousarray(below[:, :-1]), np.ascontiguousarray(below[:, 1:])


@kernel(
    'u1[:,:,::1], i8[:,::1], u4[:,::1], u1[:,::1], i4[:,::1], UniTuple(i8, 2), i8, '
    'UniTuple(i8, 3), i4[:,::1]'
)
def _add_up(  # type: ignore[no-untyped-def]
    images, pixels, order, values, split, corner, step, windows, out
):
    """Put the common areas of all templates into ``out``, from its second row on."""
    templates = order.shape[1]
    count, rows, columns = windows
    # Window by window, so that what a pixel adds to lies together.
    totals = np.zeros((count * rows * columns, templates), np.int32)
    everywhere = np.zeros(len(totals), np.int32)
    for pixel in range(len(pixels)):
        top, left = corner[0] + pixels[pixel, 0], corner[1] + pixels[pixel, 1]
        order_here, values_here, split_here = order[pixel], values[pixel], split[pixel]
        black = split_here[0]
        lane = 0
        for image in range(count):
            for row in range(rows):
                line = images[image, top + row * step]
                for column in range(columns):
                    value = np.int32(line[left + column * step])
                    total = totals[lane]
                    middle = split_here[value]
                    if middle < templates - black:
                        everywhere[lane] += value
                        for rank in range(middle):
                            total[order_here[rank]] -= value - np.int32(values_here[rank])
                    elif value > 0:
                        for rank in range(black, middle):
                            total[order_here[rank]] += values_here[rank]
                        for rank in range(middle, templates):
                            total[order_here[rank]] += value
                    lane += 1
    for lane in range(len(totals)):
        for template in range(templates):
            out[template + 1, lane] = everywhere[lane] + totals[lane, template]
