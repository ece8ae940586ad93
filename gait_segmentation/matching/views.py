# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The directions from which the sequences of a bank are seen, and what lies between them."""

from __future__ import annotations

import math
from functools import lru_cache

from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.matching.transitions import turned

__all__ = ['Views', 'views_of']

_WIDEST = math.pi / 4
"""Views further apart have nothing between them."""


class Views:
    """The ring of views of each build."""

    def __init__(self, bank: TemplateBank) -> None:
        """Order the sequences of each build by azimuth."""
        self._azimuth = [float(azimuth) for azimuth in bank.azimuth]
        self._beside = []
        for sequence, build in enumerate(bank.builds):
            alike = [k for k, name in enumerate(bank.builds) if name == build]
            alike.sort(key=self._azimuth.__getitem__)
            place = alike.index(sequence)
            self._beside.append((alike[place - 1], alike[(place + 1) % len(alike)]))

    def beside(self, sequence: int) -> tuple[int, int]:
        """Return the neighbouring views of the same build, clockwise and anticlockwise."""
        return self._beside[sequence]

    def azimuth(self, sequence: int, offset: float) -> float:
        """Return the azimuth ``offset`` views beside a sequence, in radians in [-pi, pi)."""
        own = self._azimuth[sequence]
        other = self._beside[sequence][1 if offset > 0 else 0]
        gap = abs(turned(self._azimuth[other] - own))
        return turned(own if gap > _WIDEST else own + offset * gap)


@lru_cache(maxsize=4)
def views_of(bank: TemplateBank) -> Views:
    """Return the views of a bank; those of the last banks are kept."""
    return Views(bank)
