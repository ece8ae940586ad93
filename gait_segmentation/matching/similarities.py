# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The Tanimoto similarity of every template at every placement, as whole numbers."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank, quantize
from gait_segmentation.kernels import kernel
from gait_segmentation.matching.path import UNIT
from gait_segmentation.matching.placements import Sampled, SearchRange
from gait_segmentation.matching.tanimoto import KERNELS, CommonAreas, WindowGrid, pitch_of

__all__ = ['SimilarityMaps', 'coded_bank']


@lru_cache(maxsize=2)
def coded_bank(
    bank: TemplateBank, levels: int, windows: WindowGrid, kernel: str = 'events'
) -> tuple[NDArray[np.uint8], CommonAreas]:
    """
    Code the templates of a bank; those of the last banks are kept, and nobody writes to them.

    :param levels: grey levels of the templates.
    :param windows: where templates are laid.
    :param kernel: which of :data:`~gait_segmentation.matching.tanimoto.KERNELS` compares them.
    :returns: the templates as they are compared, (V, P, H, W) uint8, and the kernel.
    """
    templates = quantize(bank.templates, levels)
    if np.array_equal(templates, bank.templates):
        templates = bank.templates
    return templates, KERNELS[kernel](templates.reshape(-1, *bank.grid), windows)


class SimilarityMaps:
    """
    Compares the likelihoods about a box with all templates of a bank.

    The Tanimoto similarity is C / (F + G - C), with C the common area of likelihood and template
    (their intersection), F the area of the likelihood and G that of the template.
    """

    def __init__(
        self,
        coded: CommonAreas,
        windows: WindowGrid,
        cost: NDArray[np.int16],
    ) -> None:
        """
        Prepare the comparison.

        :param windows: where templates are laid, as when they were coded.
        :param cost: (S,) int16 in path units, what each body height costs.
        """
        self._coded, self._windows, self._cost = coded, windows, cost
        self._matrix = coded.new_matrix()
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
        common = self._common_rows(images, searched, self._common)
        # Of known pixels, G is the common area with a likelihood that is white there.
        seen = self._coded.area[:, None].copy()
        if known is not None:
            seen = self._common_rows(known, searched, self._seen)
        _compare(common, area, cost, self._maps, seen)
        return self._maps

    def _make_room(self, placements: int) -> None:
        """Make the memory to work in for a number of placements."""
        made = self._coded
        self._common, self._seen = made.new_rows(placements), made.new_rows(placements)
        self._maps = np.zeros((made.rows, pitch_of(placements)), np.int16)

    def _common_rows(
        self, images: NDArray[np.uint8], searched: SearchRange, out: NDArray[np.int32]
    ) -> NDArray[np.int32]:
        """Return C of all templates, see :meth:`CommonAreas.common_rows`."""
        first = searched.first[1:]
        return self._coded.common_rows(images, first, searched.shape, self._matrix, out)


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
