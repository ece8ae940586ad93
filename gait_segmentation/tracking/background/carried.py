# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The background as the last learnt frame left it, and as it looks in the frames since."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.ego_motion.world_motion import WorldMotion
from gait_segmentation.images import Window
from gait_segmentation.tracking.background.model import BackgroundModel

__all__ = ['CarriedBackground']


class CarriedBackground:
    """
    A background that is learnt late, and known in each frame all the same.

    Masks come back frames after their image.  ``model`` is the background in the last frame that
    was taken, from which each newer one gets a model of its own, in one step for however many
    motions, since each step blurs.  Where a frame is taken of which that model still holds,
    because nothing was learnt meanwhile, it takes the place of ``model``.
    """

    def __init__(self, shape: tuple[int, int]) -> None:
        """Begin with nothing known, for a working image of the given (h, w)."""
        self.model = BackgroundModel(shape)
        self.version = 0
        """Counts what has changed since a frame's own background was made."""

    def ahead(self, steps: Sequence[WorldMotion], windows: Sequence[Window]) -> BackgroundModel:
        """
        Return the background as it looks in a newer frame.

        :param steps: motions from the last frame that was taken, oldest first.
        :param windows: the rows and columns to know it in.
        """
        return self.model.moved(steps, windows)

    def skip(self, motion: WorldMotion, windows: Sequence[Window]) -> None:
        """Go on to the next frame, from which nothing is learnt."""
        self.model = self.model.moved([motion], windows)

    def take(
        self,
        motion: WorldMotion,
        windows: Sequence[Window],
        ahead: BackgroundModel,
        version: int,
    ) -> None:
        """
        Go on to the next frame, to learn from it.

        :param ahead: what :meth:`ahead` returned for it.
        :param version: :attr:`version` at that time.
        """
        if version != self.version:
            self.model = self.model.moved([motion], windows)
        else:
            self.model = ahead
        self.version += 1

    def forget(
        self, where: NDArray[np.uint8], ahead: BackgroundModel, steps: Sequence[WorldMotion]
    ) -> None:
        """
        Forget some pixels.

        :param where: (h, w) uint8, non-zero where to forget.
        :param ahead: the background of the newest frame.
        :param steps: motions from the last frame that was taken to it, oldest first.
        """
        self.model.forget(where)
        ahead.forget(where)
        self._outdate(steps)

    def forget_all(self, ahead: BackgroundModel) -> None:
        """
        Forget what the surroundings look like: they are others.

        :param ahead: the background of the newest frame.
        """
        for model in (self.model, ahead):
            model.sums[:] = 0
        self.version += 1

    def adopt(
        self, known: BackgroundModel, ahead: BackgroundModel, steps: Sequence[WorldMotion]
    ) -> None:
        """
        Take over what is known from elsewhere, where less is known here.

        :param known: as it looks in the newest frame.
        :param ahead: the background of that frame.
        :param steps: motions from the last frame that was taken to it, oldest first.
        """
        ahead.adopt(known)
        self._outdate(steps)
        if ahead is not self.model:
            self.model.adopt(known.moved([WorldMotion.over(steps).inverse()]))

    def _outdate(self, steps: Sequence[WorldMotion]) -> None:
        """Let none of the frames before the newest bring back what it looked like in them."""
        if len(steps) > 1:
            self.version += 1
