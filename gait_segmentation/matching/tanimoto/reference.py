# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The definition of the common area, in NumPy."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.matching.tanimoto.kernel import CommonAreas, Images, Place, Shape

__all__ = ['ReferenceKernel']


class ReferenceKernel(CommonAreas):
    """
    C = sum of min(v, g) over all pixels, window by window and template by template.

    Wang, Yagi and Makihara, ACCV 2009, equation 1.
    """

    def _code(self, templates: Images) -> NDArray[np.int32]:
        self._templates = templates.reshape(-1, self._grid.height, self._grid.width)
        return np.arange(len(templates), dtype=np.int32)

    def _fill(
        self, images: Images, first: Place, windows: Shape, matrix: Images, out: NDArray[np.int32]
    ) -> None:
        every = self._grid.windows(images)
        for lane, (image, row, column) in enumerate(np.ndindex(windows)):
            window = every[image, first[0] + row, first[1] + column]
            common = np.minimum(self._templates, window)
            out[1 : self.rows + 1, lane] = common.sum(axis=(1, 2), dtype=np.int32)
