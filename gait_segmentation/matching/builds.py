# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Several builds in one bank, and their kernels."""

from __future__ import annotations

from copy import copy

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.matching.tanimoto import EventKernel, WindowGrid

__all__ = ['BuildKernels', 'builds_of']


def builds_of(bank: TemplateBank) -> NDArray[np.intp]:
    """Return the build of each sequence, (V,) intp: its place among the builds' names."""
    names = sorted(set(bank.builds))
    return np.array([names.index(build) for build in bank.builds])


class BuildKernels:
    """One kernel for the templates of each build, with one numbering of their rows."""

    def __init__(
        self, templates: NDArray[np.uint8], of_sequence: NDArray[np.intp], grid: WindowGrid
    ) -> None:
        """
        Code the templates.

        :param templates: (V, P, H, W) uint8.
        :param of_sequence: (V,) intp, build of each sequence, 0, 1, 2, ...
        """
        self.row: NDArray[np.int32] = np.empty(templates.shape[:2], np.int32)
        self._kernels: list[EventKernel] = []
        self._parts: list[slice] = []
        rows = 0
        for build in range(int(of_sequence.max()) + 1):
            chosen = of_sequence == build
            kernel = EventKernel(templates[chosen].reshape(-1, *templates.shape[2:]), grid)
            self.row[chosen] = rows + kernel.row.reshape(-1, templates.shape[1])
            self._kernels.append(kernel)
            self._parts.append(slice(rows, rows + kernel.rows))
            rows += kernel.rows
        self.rows = rows

    def copy(self) -> BuildKernels:
        """Return kernels of the same templates that work in memory of their own."""
        other = copy(self)
        other._kernels = [kernel.copy() for kernel in self._kernels]
        return other

    def part(self, build: int) -> slice:
        """Return the rows of a build, among those of all."""
        return self._parts[build]

    def new_rows(self, windows: int) -> NDArray[np.int32]:
        """Return an array for ``out`` of :meth:`common_rows`, for any of the builds."""
        return max(self._kernels, key=lambda kernel: kernel.rows).new_rows(windows)

    def common_rows(
        self,
        planes: NDArray[np.uint8],
        build: int,
        first: tuple[int, int],
        windows: tuple[int, int, int],
        out: NDArray[np.int32],
    ) -> NDArray[np.int32]:
        """
        Compute C for the templates of a build, see :meth:`EventKernel.common_rows`.

        :returns: (R, N) int32, a view of ``out``, for the rows of :meth:`part`; template p of
            sequence v is row ``row[v, p]`` of all.
        """
        return self._kernels[build].common_rows(planes, first, windows, out)
