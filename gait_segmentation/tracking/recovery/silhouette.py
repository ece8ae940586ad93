# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A silhouette cut out of its image, to be laid where the person is looked for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import Bounds, bounding_box
from gait_segmentation.tracking.person.person import Person

__all__ = ['Silhouette']


@dataclass(frozen=True)
class Silhouette:
    """
    A mask cut out, which can be laid anywhere, even where part of it is outside of the image.

    ``mask`` is (h, w) uint8 0/255; ``left`` and ``top`` are where it begins relative to the
    centre of the body, in pixels.
    """

    mask: NDArray[np.uint8]
    left: int
    top: int

    @classmethod
    def of(
        cls, mask: NDArray[np.uint8], person: Person, bounds: Bounds | None = None
    ) -> Silhouette:
        """Cut out the mask of a person; its bounds may be known."""
        x, y, width, height = bounding_box(mask) if bounds is None else bounds
        part = mask[y : y + height, x : x + width].copy()
        return cls(part, x - round(person.center_x), y - round(person.center_y))

    @property
    def middle(self) -> tuple[float, float]:
        """Return the middle of the cut-out relative to the centre of the body."""
        return self.left + self.mask.shape[1] / 2, self.top + self.mask.shape[0] / 2

    def placed(self, person: Person, shape: tuple[int, int]) -> NDArray[np.uint8]:
        """Return the mask of an image of the given (h, w) with the person where it is now."""
        out = np.zeros(shape, np.uint8)
        left, top = round(person.center_x) + self.left, round(person.center_y) + self.top
        height, width = self.mask.shape
        x0, y0 = max(left, 0), max(top, 0)
        x1, y1 = min(left + width, shape[1]), min(top + height, shape[0])
        if x0 < x1 and y0 < y1:
            out[y0:y1, x0:x1] = self.mask[y0 - top : y1 - top, x0 - left : x1 - left]
        return out
