# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How similar all templates are to the likelihood, at all placements searched."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank, quantize
from gait_segmentation.kernels import kernel
from gait_segmentation.matching.common_areas import (
    CommonAreas,
    DirectAccessTableKernel,
    WindowGrid,
    pitch_of,
)
from gait_segmentation.matching.events import EventKernel
from gait_segmentation.matching.path import UNIT
from gait_segmentation.matching.placements import Sampled, SearchRange

KERNELS: dict[str, type[CommonAreas]] = {
    'events': EventKernel,
    'direct_access_table': DirectAccessTableKernel,
}
"""Those there are to choose from (``matching.kernel``); they give the same bits."""


@lru_cache(maxsize=2)
def coded_bank(
    bank: TemplateBank, levels: int, windows: WindowGrid, kernel: str
) -> tuple[NDArray[np.uint8], CommonAreas]:
    """
    Code the templates of a bank; those of the last banks are kept, and nobody writes to them.

    :param levels: grey levels of the templates.
    :param windows: where templates are laid.
    :param kernel: which of :data:`KERNELS` compares them.
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

    def __init__(self, coded: CommonAreas, windows: WindowGrid, cost: NDArray[np.int16]) -> None:
        """
        Prepare the comparison.

        :param windows: where templates are laid, as when they were coded.
        :param cost: (S,) int16 in path units, what each body height costs.
        """
        self._coded, self._windows, self._cost = coded, windows, cost
        self._matrix = coded.new_matrix()
        self._maps = np.zeros((coded.rows, 0), np.int16)

    def update(self, sampled: Sampled, searched: SearchRange) -> NDArray[np.int16]:
        """
        Compare a frame.

        :returns: (R, N) int16, similarities in path units less the cost of the body height, of
            the template of a row at each of the placements searched; what follows is undefined.
            The next call overwrites it.
        """
        heights, coded = searched.heights, self._coded
        images = sampled.images[heights]
        pitch = pitch_of(searched.size)
        if self._maps.shape[1] != pitch:
            self._common, self._seen = coded.new_rows(pitch), coded.new_rows(pitch)
            self._maps = np.zeros((coded.rows, pitch), np.int16)
        areas = self._windows.areas(images)[:, searched.rows, searched.columns]
        # One line for all placements, filled up with zeros.
        area, cost = np.zeros((2, pitch), np.int32)
        area[: areas.size] = areas.reshape(-1)
        cost[: areas.size] = np.repeat(self._cost[heights], areas[0].size)
        search = searched.first[1:], searched.shape, self._matrix
        common = coded.common_rows(images, *search, self._common)
        seen = coded.area[:, None]
        if sampled.known is not None:
            # Of known pixels, G is the common area with a likelihood that is white there.
            seen = coded.common_rows(sampled.known[heights], *search, self._seen)
        _compare(common, area, cost, self._maps, seen)
        return self._maps


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
