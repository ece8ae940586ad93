# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Several builds in one bank: which are searched in a frame, and their kernels."""

from __future__ import annotations

from copy import copy

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.matching.config import MatchingConfig
from gait_segmentation.matching.tanimoto import EventKernel, WindowGrid

__all__ = ['BuildChoice', 'BuildKernels', 'builds_of']

_LONGEST = 8
"""Longest rest between trials, in first ones."""


def builds_of(bank: TemplateBank) -> NDArray[np.intp]:
    """Return the build of each sequence, (V,), as its place among the names of the builds."""
    names = sorted(set(bank.builds))
    return np.array([names.index(build) for build in bank.builds])


class BuildChoice:
    """
    Decides which builds are searched.

    A person's build does not change, so all builds are tried for a while and then only the one
    that leads is searched, with another trial from time to time: twice as late after each one
    that leaves it at that.
    """

    def __init__(self, bank: TemplateBank, config: MatchingConfig) -> None:
        """Start with a trial."""
        self._config = config
        self.of_sequence = builds_of(bank)
        self.count = int(self.of_sequence.max()) + 1
        self.reset()

    def reset(self) -> None:
        """Begin a trial at the next frame."""
        self._trial_since: float | None = None
        self._only: int | None = None
        self._last: int | None = None
        self._rest = self._config.build_rest

    def choose(self, seconds: float, leading: NDArray[np.int16]) -> NDArray[np.bool_]:
        """
        Return which builds to search in a frame.

        :param seconds: its time.
        :param leading: (V, P) int16, scores of all templates after the frame before.
        :returns: (builds,) bool.
        """
        config = self._config
        if self._trial_since is None:
            self._trial_since, self._only = seconds, None
        since = seconds - self._trial_since
        if config.build_rest > 0 and since >= config.build_trial + self._rest:
            self._trial_since, self._only = seconds, None
        elif config.build_rest > 0 and since >= config.build_trial and self._only is None:
            self._only = int(self.of_sequence[int(leading.argmax()) // leading.shape[1]])
            longer = min(2 * self._rest, _LONGEST * config.build_rest)
            self._rest = longer if self._only == self._last else config.build_rest
            self._last = self._only
        active = np.full(self.count, self._only is None)
        if self._only is not None:
            active[self._only] = True
        return active


class BuildKernels:
    """One kernel for the templates of each build, with one numbering of their rows."""

    def __init__(
        self, templates: NDArray[np.uint8], of_sequence: NDArray[np.intp], grid: WindowGrid
    ) -> None:
        """
        Code the templates.

        :param templates: (V, P, H, W) uint8.
        :param of_sequence: (V,) build of each sequence, 0, 1, 2, ...
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
        self.pitch = self._kernels[0].pitch

    def copy(self) -> BuildKernels:
        """Return kernels of the same templates that work in memory of their own."""
        other = copy(self)
        other._kernels = [kernel.copy() for kernel in self._kernels]
        return other

    def part(self, build: int) -> slice:
        """Return the rows of a build, among those of all."""
        return self._parts[build]

    def new_rows(self) -> NDArray[np.int32]:
        """Return an array for ``out`` of :meth:`common_rows`, for any of the builds."""
        return max(self._kernels, key=lambda kernel: kernel.rows).new_rows()

    def common_rows(
        self, plane: NDArray[np.uint8], build: int, out: NDArray[np.int32]
    ) -> NDArray[np.int32]:
        """
        Compute C for the templates of a build.

        :param plane: one image of :func:`polyphase`.
        :param out: from :meth:`new_rows`, to work in.
        :returns: (R, pitch) int32, a view, for the rows of :meth:`part`; template p of sequence v
            is row ``row[v, p]`` of all.  What follows after rows * columns is undefined.
        """
        kernel = self._kernels[build]
        kernel.fill_rows(plane, out)
        return out[1 : kernel.rows + 1]
