# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What moves now: the difference to a frame shortly before, on a canvas that may be shifted."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import compose, pixel_affine
from gait_segmentation.images import shift_whole

__all__ = ['RecentFrames']

_GAP_S = 0.14
"""Time between the two frames whose difference shows what moves now."""

_MOST_FRAMES = 32
_LEAST_LEVEL = 8.0
"""Least difference that is motion, in grey levels."""

_EDGE_PX = 2
"""Rim of a shifted frame that is not compared."""


@dataclass
class _Recent:
    """The lightness of a frame, and by how much the canvas has moved since."""

    seconds: float
    gray: NDArray[np.uint8]
    offset: tuple[int, int] = (0, 0)


class RecentFrames:
    """Keeps the lightness of the last frames on the canvas."""

    def __init__(self) -> None:
        """Keep nothing yet."""
        self._frames: deque[_Recent] = deque()

    @property
    def period(self) -> float:
        """Return the time between two frames in seconds, 0 if it is not known."""
        frames = self._frames
        return (frames[-1].seconds - frames[0].seconds) / max(len(frames) - 1, 1) if frames else 0

    def update(self, gray: NDArray[np.uint8], seconds: float, level: float) -> NDArray[np.uint8]:
        """
        Take in a frame.

        :param gray: (h, w) uint8 lightness on the canvas.
        :param level: least difference that counts, in grey levels.
        :returns: (h, w) uint8, 255 where something moves now.
        """
        frames = self._frames
        frames.append(_Recent(seconds, gray))
        while len(frames) > 2 and (
            seconds - frames[1].seconds >= _GAP_S or len(frames) > _MOST_FRAMES
        ):
            frames.popleft()
        offset = frames[0].offset
        before = shift_whole(frames[0].gray, *offset)
        level = max(level, _LEAST_LEVEL)
        _, moving = cv2.threshold(cv2.absdiff(gray, before), level, 255, cv2.THRESH_BINARY)
        moving = cv2.medianBlur(moving, 3)
        if any(offset):
            _blank_rim(moving, *offset)
        return moving

    def shift(self, dx: int, dy: int) -> None:
        """Move with the canvas by whole pixels."""
        for each in self._frames:
            each.offset = each.offset[0] + dx, each.offset[1] + dy

    def warp(self, motion: NDArray[np.float64]) -> None:
        """Resample for a canvas that is laid anew by a 2 x 3 transform of positions."""
        for each in self._frames:
            dx, dy = each.offset
            moved = compose(motion, np.array([[1.0, 0, dx], [0, 1.0, dy]]))
            # What of the offset is whole pixels stays one, for the rim that is not compared.
            dx, dy = each.offset = round(float(moved[0, 2])), round(float(moved[1, 2]))
            moved = compose(np.array([[1.0, 0, -dx], [0, 1.0, -dy]]), moved)
            each.gray = np.asarray(
                cv2.warpAffine(
                    each.gray,
                    pixel_affine(moved),
                    each.gray.shape[::-1],
                    flags=cv2.INTER_LINEAR,
                    borderMode=cv2.BORDER_REPLICATE,
                )
            )


def _blank_rim(moving: NDArray[np.uint8], dx: int, dy: int) -> None:
    """Clear where the earlier of two frames, shifted by (dx, dy), shows nothing."""
    height, width = moving.shape
    if dx > 0:
        moving[:, : dx + _EDGE_PX] = 0
    elif dx < 0:
        moving[:, max(width + dx - _EDGE_PX, 0) :] = 0
    if dy > 0:
        moving[: dy + _EDGE_PX] = 0
    elif dy < 0:
        moving[max(height + dy - _EDGE_PX, 0) :] = 0
