# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Motion of a world whose ground moves otherwise than what is far behind: images in two parts."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import compose, scaling
from gait_segmentation.images import Window
from gait_segmentation.warping import warp_window

__all__ = ['Ground', 'ground_over', 'parted', 'warp_parts']


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


def ground_over(
    steps: Iterable[tuple[NDArray[np.float64] | None, Ground | None]],
) -> Ground | None:
    """
    Return the motion of the ground over several frames, None if it moved as the world did.

    :param steps: the motions of world and ground from each frame to the next, oldest first.
    """
    made = list(steps)
    rows = [ground.row for _, ground in made if ground is not None]
    if not rows:
        return None
    total = scaling(1.0)
    for camera, ground in made:
        motion = camera if ground is None else ground.motion
        if motion is not None:
            total = compose(motion, total)
    return Ground(total, rows[-1])


def parted(windows: Sequence[Window], ground: Ground | None) -> tuple[list[Window], list[Window]]:
    """Return the parts of windows above where the ground ends, and those of the ground."""
    if ground is None:
        return list(windows), []
    parts = [ground.split(window) for window in windows]
    upper = [above for above, _ in parts if _rows(above)]
    return upper, [below for _, below in parts if _rows(below)]


def warp_parts(
    image: NDArray[np.uint8],
    camera: NDArray[np.float64],
    ground: Ground | None,
    window: Window,
    border: int = cv2.BORDER_REPLICATE,
) -> NDArray[np.uint8]:
    """
    Warp an image by the motion of the world, and of the ground from where that begins.

    :param image: (H, W) or (H, W, C) uint8.
    :param camera: 2 x 3 transform of positions of the world from the image to the result.
    :param ground: of the ground, None if it moves as the world does.
    :param window: the rows and columns to compute.
    :param border: what lies outside of the image, a ``cv2.BORDER_`` constant.
    """
    if ground is None:
        return warp_window(image, camera, window, border)
    upper, lower = ground.split(window)
    if not _rows(lower):
        return warp_window(image, camera, window, border)
    below = warp_window(image, ground.motion, lower, border)
    if not _rows(upper):
        return below
    return np.concatenate([warp_window(image, camera, upper, border), below])


def _rows(window: Window) -> int:
    return int(window[0].stop - window[0].start)
