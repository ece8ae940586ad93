# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is known of the background in a window about a person, and places about the body there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.geometry import BodyFrame
from gait_segmentation.images import Window
from gait_segmentation.kernels import kernel
from gait_segmentation.lab import NO_GRADIENT
from gait_segmentation.tracking.background.model import BackgroundModel

__all__ = ['COLUMNS', 'EVERY', 'ROWS', 'Backdrop', 'Place', 'is_near', 'settle_places', 'tint_of']

_PLACE_STEP, ROWS, COLUMNS = 0.1, 12, 16
"""Size of a place in body heights, and the places from the head down and about the axis."""

_DARKER = 2.5
"""By how much a shadow is darker than the background, in ``sigma``."""

EVERY = 2
"""Every how many rows and columns pixels are learnt from."""

Place = tuple[float, float, float]
"""Row and column, in steps, of a window's first pixel among the places, and steps per pixel."""


@dataclass(frozen=True)
class Backdrop:
    """
    A window of a working image, and what is known of the background there.

    ``lab`` is (h, w, 3) uint8, the window, and ``window`` its rows and columns; ``textured`` tells
    whether gradient energy stands for a* and b*.
    """

    lab: NDArray[np.uint8]
    window: Window
    background: BackgroundModel
    textured: bool

    @property
    def darker(self) -> float:
        """Return by how many levels a shadow is darker than the background."""
        return _DARKER * self.background.sigma

    @property
    def neutral(self) -> float:
        """Return what a* and b* are where there is no colour."""
        return NO_GRADIENT if self.textured else 128.0

    def place(self, body: BodyFrame) -> Place:
        """Return where about a body the window lies."""
        rows, columns = self.window
        step = 1 / (_PLACE_STEP * body.height)
        row = step * (rows.start + 0.5 - body.center_y + body.height / 2)
        return row, step * (columns.start + 0.5 - body.center_x) + COLUMNS / 2, step


@njit(nogil=True, inline='always')
def is_near(where: NDArray[np.uint8], row: int, col: int, far: int, most: int) -> bool:
    """Tell whether a pixel, or one so far above, below or beside it, is above some level."""
    height, width = where.shape
    over, under = max(row - far, 0), min(row + far, height - 1)
    before, after = max(col - far, 0), min(col + far, width - 1)
    about = where[row, col] | where[over, col] | where[under, col]
    return (about | where[row, before] | where[row, after]) > most


@njit(nogil=True, error_model='numpy', inline='always')
def tint_of(
    level: np.uint8, known: np.float32, count: np.float32, ratio: float, neutral: float
) -> float:
    """
    Return what a* or b* is off that of the background in a neutral shadow.

    :param known, count: sum of the background's levels, and how often it was seen.
    :param ratio: of L + 16 over the background's.
    """
    return np.float32(level) - neutral - ratio * (known / count - neutral)


@kernel(error_model='numpy')
def settle_places(seen: NDArray[np.float32], few: float, share: NDArray[np.float32]) -> None:
    """
    Smooth by 1 2 3 2 1 along each axis what share of the background is in the shadow.

    :param seen: (2, rows, columns) float32, what was seen of the background at each place, and in
        the shadow.
    :param few: what halves the share.
    :param share: (rows, columns) float32, changed.
    """
    for row in range(ROWS):
        for col in range(COLUMNS):
            every, dark = np.float32(few), np.float32(0)
            for i in range(max(row - 2, 0), min(row + 3, ROWS)):
                for j in range(max(col - 2, 0), min(col + 3, COLUMNS)):
                    weight = np.float32((3 - abs(i - row)) * (3 - abs(j - col)))
                    every += weight * seen[0, i, j]
                    dark += weight * seen[1, i, j]
            share[row, col] = dark / every
