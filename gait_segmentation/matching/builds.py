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


def builds_of(bank: TemplateBank) -> NDArray[np.intp]:
    """Return the build of each sequence, (V,), as its place among the names of the builds."""
    names = sorted(set(bank.builds))
    return np.array([names.index(build) for build in bank.builds])


class BuildChoice:
    """
    Decides which builds are searched.

    A person's build does not change, so all builds are tried for a while and then only the one
    that leads is searched, with another trial from time to time.
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
        if config.build_rest > 0 and since >= config.build_trial + config.build_rest:
            self._trial_since, self._only = seconds, None
        elif config.build_rest > 0 and since >= config.build_trial and self._only is None:
            self._only = int(self.of_sequence[int(leading.argmax()) // leading.shape[1]])
        active = np.full(self.count, self._only is None)
        if self._only is not None:
            active[self._only] = True
        return active


class BuildKernels:
    """One kernel for the templates of each build, with their results in one array."""

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
        self._first: list[int] = []
        rows = 0
        for build in range(int(of_sequence.max()) + 1):
            chosen = of_sequence == build
            kernel = EventKernel(templates[chosen].reshape(-1, *templates.shape[2:]), grid)
            # Row 0 of each part is the empty template that its arborescence starts from.
            self.row[chosen] = rows + 1 + kernel.row.reshape(-1, templates.shape[1])
            self._kernels.append(kernel)
            self._first.append(rows)
            rows += 1 + int(kernel.row.max()) + 1
        self._rows = rows
        self.pitch = self._kernels[0].pitch

    def copy(self) -> BuildKernels:
        """Return kernels of the same templates that work in memory of their own."""
        other = copy(self)
        other._kernels = [kernel.copy() for kernel in self._kernels]
        return other

    def new_rows(self, images: int) -> NDArray[np.int32]:
        """Return an array for the results of a number of images."""
        return np.zeros((images, self._rows, self.pitch), np.int32)

    def common_rows(
        self, images: NDArray[np.uint8], active: NDArray[np.bool_], out: NDArray[np.int32]
    ) -> None:
        """
        Compute C for the templates of the active builds.

        :param images: (S, height, width) uint8 of the grid's padded size.
        :param active: (builds,) bool.
        :param out: from :meth:`new_rows`; template p of sequence v goes to ``row[v, p]``.
        """
        last = [*self._first[1:], self._rows]
        for build in np.flatnonzero(active):
            self._kernels[build].common_rows(images, out[:, self._first[build] : last[build]])
