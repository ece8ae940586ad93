# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Solids made of ellipsoids: the value that is drawn, and a maker that collects it.

A *piece* is the convex hull of one or more ellipsoids, which may be flat; a body is a number of
pieces, each belonging to a named part.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.skeleton import Frame

__all__ = ['PARTS', 'Body', 'BodyMaker', 'upright']

PARTS = ('head', 'torso', 'skirt', 'rucksack', 'arms', 'hands', 'legs', 'feet')

Points = NDArray[np.float64]


@dataclass(frozen=True)
class Body:
    """
    Ellipsoids and the pieces they span.

    :param centers: (P, E, 3) centres in statures, axes of the body as in the skeleton.
    :param axes: (P, E, 3, 3), semi-axes as columns.
    :param pieces: the ellipsoids of every piece.
    :param parts: the part of every piece, an index into :data:`PARTS`.
    """

    centers: Points
    axes: Points
    pieces: tuple[tuple[int, ...], ...]
    parts: tuple[int, ...]


class BodyMaker:
    """Collects ellipsoids and pieces."""

    def __init__(self) -> None:
        self.centers: list[Points] = []
        self.axes: list[Points] = []
        self.pieces: list[tuple[int, ...]] = []
        self.parts: list[int] = []

    def ellipsoid(
        self, center: Points, frame: Frame, breadth: float, depth: float, length: float = 0.0
    ) -> int:
        """Add an ellipsoid with half sizes along ``left``, ``front`` and ``along``."""
        self.centers.append(center)
        self.axes.append(
            np.stack([breadth * frame.left, depth * frame.front, length * frame.along], axis=-1)
        )
        return len(self.centers) - 1

    def hull(self, part: str, *members: int) -> None:
        """Add the convex hull of some ellipsoids."""
        self.pieces.append(members)
        self.parts.append(PARTS.index(part))

    def chain(self, part: str, members: list[int]) -> None:
        """Add the hulls of neighbours."""
        for first, second in itertools.pairwise(members):
            self.hull(part, first, second)

    def done(self) -> Body:
        """Return what was collected."""
        return Body(
            np.stack(self.centers, axis=1),
            np.stack(self.axes, axis=1),
            tuple(self.pieces),
            tuple(self.parts),
        )


def upright(frame: Frame) -> Frame:
    """Return the frame with the same phases that is upright and looks ahead."""
    one = np.broadcast_to(np.eye(3), (len(frame.along), 3, 3))
    return Frame(one[:, 2], one[:, 0], one[:, 1])
