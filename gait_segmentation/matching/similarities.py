# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The Tanimoto similarity of every template at every placement, as whole numbers."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.gait_model.builder import quantize
from gait_segmentation.kernels import kernel
from gait_segmentation.matching.path import UNIT
from gait_segmentation.matching.placements import Sampled, SearchRange
from gait_segmentation.matching.tanimoto import KERNELS, CommonAreas, WindowGrid, pitch_of

__all__ = ['CodedBank', 'SimilarityMaps', 'coded_bank', 'filled_up']


@dataclass(frozen=True)
class CodedBank:
    """
    The templates of a bank as they are compared; matchers share it, and nobody writes to it.

    Equal templates, such as the half-cycle twins of a profile, share a *row*.

    ``templates`` is (V, P, H, W) uint8 with few grey levels and ``row`` (V, P) int32 the row of
    each in the results of ``kernel``.  ``sums`` are running sums over the lines of the templates,
    (R, H + 1) and (R, W + 1) int32, from 0 on.
    """

    templates: NDArray[np.uint8]
    row: NDArray[np.int32]
    kernel: CommonAreas
    sums: tuple[NDArray[np.int32], NDArray[np.int32]]

    @property
    def area(self) -> NDArray[np.int32]:
        """Return G, (R,) int32, the area of each template."""
        return self.sums[0][:, -1]


@lru_cache(maxsize=2)
def coded_bank(
    bank: TemplateBank, levels: int, windows: WindowGrid, kernel: str = 'events'
) -> CodedBank:
    """
    Code the templates of a bank; those of the last banks are kept.

    :param levels: grey levels of the templates.
    :param windows: where templates are laid.
    :param kernel: which of :data:`~gait_segmentation.matching.tanimoto.KERNELS` compares them.
    """
    templates = quantize(bank.templates, levels)
    if np.array_equal(templates, bank.templates):
        templates = bank.templates
    made = KERNELS[kernel](templates.reshape(-1, *bank.grid), windows)
    row = made.row.reshape(templates.shape[:2])
    sums = tuple(np.zeros((made.rows, size + 1), np.int32) for size in bank.grid)
    for each, axis in zip(sums, (3, 2), strict=True):
        each[row, 1:] = np.cumsum(templates.sum(axis=axis, dtype=np.int32), axis=2)
    return CodedBank(templates, row, made, (sums[0], sums[1]))


class SimilarityMaps:
    """
    Compares the likelihoods about a box with all templates of a bank.

    The Tanimoto similarity is C / (F + G - C), with C the common area of likelihood and template
    (their intersection), F the area of the likelihood and G that of the template.
    """

    def __init__(
        self,
        coded: CodedBank,
        windows: WindowGrid,
        cost: NDArray[np.int16],
    ) -> None:
        """
        Prepare the comparison.

        :param windows: where templates are laid, as when they were coded.
        :param cost: (S,) int16 in path units, what each body height costs.
        """
        self._coded, self._windows, self._cost = coded, windows, cost
        self._matrix = coded.kernel.new_matrix()
        self._make_room(0)

    def update(self, sampled: Sampled, searched: SearchRange) -> NDArray[np.int16]:
        """
        Compare a frame.

        :param sampled: the likelihood about the box.
        :param searched: the placements that are.
        :returns: (R, N) int16, similarities in path units less the cost of the body height, of
            the template of a row at each of the placements searched; what follows is undefined.
            The next call overwrites it.
        """
        heights, size = searched.heights, searched.size
        images = sampled.images[heights]
        known = None if sampled.known is None else sampled.known[heights]
        if self._maps.shape[1] != pitch_of(size):
            self._make_room(size)
        areas = self._windows.areas(images)[:, searched.rows, searched.columns]
        area = _line(areas, self._maps.shape[1])
        cost = _line(np.broadcast_to(self._cost[heights, None, None], areas.shape), len(area))
        lines = None if known is None else _known_lines(known)
        common = self._common_rows(images, searched, self._common)
        if lines is not None:
            seen = self._between(lines, searched)
        elif known is not None:
            seen = self._common_rows(known, searched, self._seen)
        else:
            seen = self._coded.area[:, None].copy()
        _compare(common, area, cost, self._maps, seen)
        return self._maps

    def _make_room(self, placements: int) -> None:
        """Make the memory to work in for a number of placements."""
        made = self._coded.kernel
        self._common, self._seen = made.new_rows(placements), made.new_rows(placements)
        self._maps = np.zeros((made.rows, pitch_of(placements)), np.int16)

    def _common_rows(
        self, images: NDArray[np.uint8], searched: SearchRange, out: NDArray[np.int32]
    ) -> NDArray[np.int32]:
        """Return C of all templates, see :meth:`CommonAreas.common_rows`."""
        made, first = self._coded.kernel, searched.first[1:]
        return made.common_rows(images, first, searched.shape, self._matrix, out)

    def _between(
        self, lines: tuple[int, NDArray[np.intp]], searched: SearchRange
    ) -> NDArray[np.int32]:
        """Return the areas of templates over the known lines, (R, N) int32, filled up."""
        axis, spans = lines
        sums = self._coded.sums[axis]
        edges = self._windows.step * np.arange(
            searched.first[1 + axis], searched.first[1 + axis] + searched.shape[1 + axis]
        )
        low, high = np.clip(spans.T[:, :, None] - edges, 0, sums.shape[1] - 1)
        between = sums[:, high] - sums[:, low]
        seen = self._seen[1 : len(sums) + 1]
        placed = seen[:, : searched.size].reshape(len(sums), *searched.shape)
        placed[...] = between[:, :, :, None] if axis == 0 else between[:, :, None, :]
        return seen


def _known_lines(known: NDArray[np.uint8]) -> tuple[int, NDArray[np.intp]] | None:
    """
    Return between which lines all is known, if nothing else is.

    Nearly always what is unknown is beyond one side of the image, or two opposite ones.  The area
    of a template over the known pixels then follows from running sums of its lines.

    :param known: (S, height, width) uint8, 0 where unknown.
    :returns: 0 for rows or 1 for columns, and (S, 2), the first line of each image that is known
        and the first one after that is not; None if the mask is something else.
    """
    for axis, line in enumerate((known[:, :, :1], known[:, :1])):
        if (known == line).all():
            found = [np.flatnonzero(each) for each in line]
            spans = [(each[0], each[-1] + 1) if len(each) else (0, 0) for each in found]
            if all(
                span[1] - span[0] == len(each) for span, each in zip(spans, found, strict=True)
            ):
                return axis, np.array(spans, np.intp)
    return None


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


@kernel('i4[:,::1], i4[::1], i4[::1], i2[:,::1], i4[:,::1]')
def _compare(common, area, cost, maps, seen):  # type: ignore[no-untyped-def]
    """
    Put the similarities of all templates into ``maps``.

    :param common: (R, N) int32, C.
    :param area: (N,) int32, F.
    :param cost: (N,) int32, taken off.
    :param maps: (R, N) int16, result.
    :param seen: (R, N) int32, G over the known pixels; (R, 1) where all are known.
    """
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
