# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The definition of the similarity, in NumPy."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.matching.tanimoto.windows import WindowGrid, check_templates

__all__ = ['ReferenceKernel']


class ReferenceKernel:
    """
    C = sum of min(v, g) over all pixels, window by window and template by template.

    Wang, Yagi and Makihara, ACCV 2009, equation 1.
    """

    def __init__(self, templates: NDArray[np.uint8], grid: WindowGrid) -> None:
        """
        Take in the templates.

        :param templates: (K, height, width) uint8.
        :raises InputError: if they do not fit the grid.
        """
        check_templates(templates, grid)
        self._templates = templates
        self._grid = grid

    def common_area(self, images: NDArray[np.uint8]) -> NDArray[np.int32]:
        """Return C for every template and window, as :class:`EventKernel` does."""
        windows = self._grid.windows(images)
        result = np.empty((len(self._templates), *windows.shape[:3]), np.int32)
        for index in np.ndindex(windows.shape[:3]):
            common = np.minimum(self._templates, windows[index])
            scale, row, column = index
            result[:, scale, row, column] = common.sum(axis=(1, 2), dtype=np.int32)
        return result
