# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The walkers of a bank in many directions, about which the phase is told."""

from __future__ import annotations

import math
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank, fine_grid

__all__ = ['FineViews', 'fine_views']

_REACH = 3
_WIDEST = math.radians(46.0)
"""Views farther apart are no neighbours."""
_ERROR = math.radians(7.0)
"""By how much the view a path begins with is wrong, standard deviation."""


class FineViews:
    """
    The walkers of a bank, in its finer views if it has such.

    Views 22.5 degrees apart are too coarse for the phase of somebody seen from the front, and so
    is blending them.  The views of a build lie in a ring; places in it are counted anticlockwise.
    Nothing is written after making, so that matchers may share it.
    """

    def __init__(self, bank: TemplateBank) -> None:
        """
        Take the finer views, or those that the bank is searched by.

        :param bank: the bank that is searched.
        """
        source = bank.finer or bank
        self.templates: NDArray[np.uint8] = source.templates
        """(V, P, h, w) uint8 in the grid of ``fine_grid``."""
        if bank.finer is None:
            self.templates = _resized(bank.templates, fine_grid(bank.grid))
        self._rings: dict[str, NDArray[np.int64]] = {}
        self._azimuth = np.asarray(source.azimuth, np.float64)
        for build in set(bank.builds):
            views = np.array([k for k, name in enumerate(source.builds) if name == build])
            self._rings[build] = views[np.argsort(self._azimuth[views], kind='stable')]
        widest = max(_widest_gap(self._azimuth[ring]) for ring in self._rings.values())
        count = min(len(ring) for ring in self._rings.values())
        self.reach = min(1 if bank.finer is None else _REACH, (count - 1) // 2)
        """How many views to either side are compared."""
        if widest > _WIDEST:
            self.reach = 0

    def place(self, build: str, azimuth: float) -> int:
        """Return the place of the view nearest to an azimuth in the ring of a build."""
        away = np.exp(1j * (self._azimuth[self._rings[build]] - azimuth)).real
        return int(away.argmax())

    def azimuth(self, build: str, place: int) -> float:
        """Return the azimuth of a place in radians."""
        ring = self._rings[build]
        return float(self._azimuth[ring[place % len(ring)]])

    def steps(self, build: str, start: int, end: int) -> int:
        """Return the shorter way round from one place to another, positive anticlockwise."""
        count = len(self._rings[build])
        return (end - start + count // 2) % count - count // 2

    def likely(self) -> NDArray[np.float64]:
        """Return how likely the views about a place are, (2 reach + 1,), if it was seen once."""
        count = min(len(ring) for ring in self._rings.values())
        away = 2 * math.pi / count * np.arange(-self.reach, self.reach + 1)
        return np.asarray(np.exp(-0.5 * (away / _ERROR) ** 2))

    def around(self, build: str, place: int) -> tuple[int, ...]:
        """Return the indices of the views about a place, clockwise ones first."""
        ring = self._rings[build]
        reach = range(-self.reach, self.reach + 1)
        return tuple(int(ring[(place + k) % len(ring)]) for k in reach)


@lru_cache(maxsize=2)
def fine_views(bank: TemplateBank) -> FineViews:
    """Return the views of a bank; those of the last banks are kept and shared."""
    return FineViews(bank)


def _widest_gap(azimuths: NDArray[np.float64]) -> float:
    """Return the widest gap between sorted azimuths, all round."""
    return float(np.diff(azimuths, append=azimuths[0] + 2 * math.pi).max())


def _resized(templates: NDArray[np.uint8], grid: tuple[int, int]) -> NDArray[np.uint8]:
    """Resample (V, P, H, W) uint8 templates, averaging where they shrink."""
    views, phases, height, width = templates.shape
    result = np.empty((views * phases, *grid), np.uint8)
    for index, template in enumerate(templates.reshape(-1, height, width)):
        cv2.resize(template, grid[::-1], result[index], interpolation=cv2.INTER_AREA)
    return result.reshape(views, phases, *grid)
