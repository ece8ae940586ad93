# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Motion of the still world, whose ground may move otherwise than what is far behind."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import carry, compose, invert, scaling
from gait_segmentation.images import Window
from gait_segmentation.warping import warp_window

__all__ = ['Ground', 'WorldMotion']

_STILL = scaling(1.0)


@dataclass(frozen=True)
class Ground:
    """Motion of the ground, 2 x 3, that holds from a row of the newer frame on downwards."""

    motion: NDArray[np.float64]
    row: int

    def split(self, window: Window) -> tuple[Window, Window]:
        """Return the parts of a window above the ground and on it, one of which may be empty."""
        rows, columns = window
        row = min(max(self.row, rows.start), rows.stop)
        return (slice(rows.start, row), columns), (slice(row, rows.stop), columns)


@dataclass(frozen=True)
class WorldMotion:
    """
    How the still world moved from an earlier frame to a later one, in working pixels.

    ``camera`` is the 2 x 3 transform of its positions, None when it did not move; ``ground`` is
    how the ground about people moved, None if as the rest.
    """

    camera: NDArray[np.float64] | None = None
    ground: Ground | None = None

    @classmethod
    def over(cls, steps: Iterable[WorldMotion]) -> WorldMotion:
        """
        Return the motion over several frames.

        The ground that was seen last has moved as the rest where it was not seen.

        :param steps: from each frame to the next, oldest first.
        """
        made = list(steps)
        total = None
        for step in made:
            if step.camera is not None:
                total = step.camera if total is None else compose(step.camera, total)
        rows = [step.ground.row for step in made if step.ground is not None]
        if not rows:
            return cls(total)
        below = _STILL
        for step in made:
            motion = step.camera if step.ground is None else step.ground.motion
            if motion is not None:
                below = compose(motion, below)
        return cls(total, Ground(below, rows[-1]))

    @property
    def transform(self) -> NDArray[np.float64]:
        """Return the 2 x 3 transform of positions, also of a world that did not move."""
        return _STILL if self.camera is None else self.camera

    def carry(self, x: float, y: float) -> tuple[float, float]:
        """Return where a position of the world, above the ground, moved to."""
        return (x, y) if self.camera is None else carry(self.camera, x, y)

    def inverse(self) -> WorldMotion:
        """Return how the world moved from the later frame to the earlier one."""
        camera = None if self.camera is None else invert(self.camera)
        if self.ground is None:
            return WorldMotion(camera)
        back = invert(self.ground.motion)
        _, row = carry(back, 0.0, self.ground.row)
        return WorldMotion(camera, Ground(back, round(row)))

    def corrected(
        self, shift: tuple[float, float] | None, low: tuple[float, float] | None = None
    ) -> WorldMotion:
        """
        Return the motion with a further shift of the world, if there is one.

        :param low: of the ground, if that moves otherwise.
        """
        if shift is None and low is None:
            return self
        camera, ground = self.camera, self.ground
        if shift is not None:
            camera = _step(shift) if camera is None else compose(_step(shift), camera)
        if low is not None and ground is not None:
            ground = replace(ground, motion=compose(_step(low), ground.motion))
        return WorldMotion(camera, ground)

    def parted(self, windows: Sequence[Window]) -> tuple[list[Window], list[Window]]:
        """Return the parts of windows above where the ground ends, and those of the ground."""
        if self.ground is None:
            return list(windows), []
        parts = [self.ground.split(window) for window in windows]
        upper = [above for above, _ in parts if _rows(above)]
        return upper, [below for _, below in parts if _rows(below)]

    def warped(
        self, image: NDArray[np.uint8], window: Window, border: int = cv2.BORDER_REPLICATE
    ) -> NDArray[np.uint8]:
        """
        Return a window of an image of the earlier frame as it looks in the later one.

        :param image: (H, W) or (H, W, C) uint8.
        :param window: the rows and columns to compute.
        :param border: what lies outside of the image, a ``cv2.BORDER_`` constant.
        """
        if self.ground is None:
            return warp_window(image, self.transform, window, border)
        upper, lower = self.ground.split(window)
        if not _rows(lower):
            return warp_window(image, self.transform, window, border)
        below = warp_window(image, self.ground.motion, lower, border)
        if not _rows(upper):
            return below
        return np.concatenate([warp_window(image, self.transform, upper, border), below])


def _step(shift: tuple[float, float]) -> NDArray[np.float64]:
    return np.array([[1.0, 0.0, shift[0]], [0.0, 1.0, shift[1]]])


def _rows(window: Window) -> int:
    return int(window[0].stop - window[0].start)
