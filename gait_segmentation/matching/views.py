# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The views of a bank: those searched, and the finer ones about which the phase is told."""

from __future__ import annotations

import math
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank, fine_grid

_WIDEST = math.radians(46.0)
"""Views farther apart are no neighbours, and have nothing between them."""
_FINE_REACH = 3
_ERROR = math.radians(7.0)
"""By how much the view a path begins with is wrong, standard deviation."""


def turned(angle: float) -> float:
    """Return an angle in [-pi, pi)."""
    return (angle + math.pi) % (2 * math.pi) - math.pi


class Views:
    """The sequences of each build in the order of their azimuths: a ring, anticlockwise."""

    def __init__(self, bank: TemplateBank) -> None:
        """Order the sequences."""
        self.azimuths = bank.azimuth.astype(np.float64)
        self.rings: dict[str, NDArray[np.int64]] = {}
        for build in dict.fromkeys(bank.builds):
            views = np.array([k for k, name in enumerate(bank.builds) if name == build])
            self.rings[build] = views[np.argsort(self.azimuths[views], kind='stable')]
        self._beside: dict[int, tuple[int, int]] = {}
        for ring in self.rings.values():
            sides = zip(np.roll(ring, 1).tolist(), np.roll(ring, -1).tolist(), strict=True)
            self._beside.update(zip(ring.tolist(), sides, strict=True))

    def beside(self, sequence: int) -> tuple[int, int]:
        """Return the neighbouring views of the same build, clockwise and anticlockwise."""
        return self._beside[sequence]

    def azimuth(self, sequence: int, offset: float) -> float:
        """Return the azimuth ``offset`` views beside a sequence, in radians in [-pi, pi)."""
        own = float(self.azimuths[sequence])
        other = float(self.azimuths[self._beside[sequence][offset > 0]])
        gap = abs(turned(other - own))
        return turned(own if gap > _WIDEST else own + offset * gap)


class FineViews(Views):
    """
    The walkers of a bank, in its finer views if it has such.

    Views 22.5 degrees apart are too coarse for the phase of somebody seen from the front, and so
    is blending them.  A *place* counts the views of a build anticlockwise.  Nothing is written
    after making, so that matchers may share it.
    """

    def __init__(self, bank: TemplateBank) -> None:
        """Take the finer views, or those that the bank is searched by."""
        super().__init__(bank.finer or bank)
        self.templates: NDArray[np.uint8] = (
            _resized(bank.templates, fine_grid(bank.grid))
            if bank.finer is None
            else bank.finer.templates
        )
        """(V, P, h, w) uint8 in the grid of ``fine_grid``."""
        rings = [self.azimuths[ring] for ring in self.rings.values()]
        widest = max(np.diff(ring, append=ring[0] + 2 * math.pi).max() for ring in rings)
        self._count = min(map(len, rings))
        reach = 1 if bank.finer is None else _FINE_REACH
        self.reach = 0 if widest > _WIDEST else min(reach, (self._count - 1) // 2)
        """How many views to either side are compared."""

    def place(self, build: str, azimuth: float) -> int:
        """Return the place of the view nearest to an azimuth."""
        away = np.exp(1j * (self.azimuths[self.rings[build]] - azimuth)).real
        return int(away.argmax())

    def steps(self, build: str, start: int, end: int) -> int:
        """Return the shorter way round from one place to another, positive anticlockwise."""
        count = len(self.rings[build])
        return (end - start + count // 2) % count - count // 2

    def around(self, build: str, place: int) -> tuple[int, ...]:
        """Return the indices of the views about a place, clockwise ones first."""
        ring = self.rings[build]
        reach = np.arange(-self.reach, self.reach + 1)
        return tuple(ring[(place + reach) % len(ring)].tolist())

    def likely(self) -> NDArray[np.float64]:
        """Return how likely the views about a place are, (2 reach + 1,), if it was seen once."""
        away = 2 * math.pi / self._count * np.arange(-self.reach, self.reach + 1)
        return np.asarray(np.exp(-0.5 * (away / _ERROR) ** 2))


@lru_cache(maxsize=2)
def fine_views(bank: TemplateBank) -> FineViews:
    """Return the views of a bank; those of the last banks are kept and shared."""
    return FineViews(bank)


def _resized(templates: NDArray[np.uint8], grid: tuple[int, int]) -> NDArray[np.uint8]:
    """Resample (V, P, H, W) uint8 templates, averaging where they shrink."""
    views, phases, height, width = templates.shape
    result = np.empty((views * phases, *grid), np.uint8)
    for index, template in enumerate(templates.reshape(-1, height, width)):
        cv2.resize(template, grid[::-1], result[index], interpolation=cv2.INTER_AREA)
    return result.reshape(views, phases, *grid)
