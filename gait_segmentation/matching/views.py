# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The builds of a bank, and the directions from which they are seen."""

from __future__ import annotations

import math

from gait_segmentation.gait_model.bank import TemplateBank

__all__ = ['Views', 'turned']

_WIDEST = math.pi / 4
"""Views further apart have nothing between them."""


def turned(angle: float) -> float:
    """Return an angle in [-pi, pi)."""
    return (angle + math.pi) % (2 * math.pi) - math.pi


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
