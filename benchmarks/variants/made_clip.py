# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A clip with truth in memory."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import SequenceError
from gait_segmentation.geometry import Box
from gait_tools.evaluation.metrics import start_box
from gait_tools.evaluation.sequence import Sequence, frame_stamp_ns

__all__ = ['MadeClip']

STILL_PX, STILL_FRAMES = 1.0, 6
"""Median way of background corners over so many frames up to which a camera stands still."""

Frame = tuple[NDArray[np.uint8], NDArray[np.uint8] | None]


@dataclass(frozen=True)
class MadeClip:
    """
    Frames, their truth, and the box that a track of the person starts from.

    ``frames`` are pairs of an image, (H, W, 3) uint8 BGR, and its truth, (H, W) uint8 (255 the
    person, 0 background, anything else ambiguous) or None; frame numbers count from 0.
    """

    name: str
    fps: float
    frames: tuple[Frame, ...] = field(repr=False)
    box: Box

    @classmethod
    def of(cls, sequence: Sequence) -> MadeClip:
        """
        Read a sequence from its first box on.

        :raises SequenceError: if it has no box for one person, or an image cannot be read.
        """
        if sequence.initial_box is None:
            raise SequenceError(f'{sequence.folder} has no initial_box: nobody to begin with')
        frames = tuple((sequence.image(n), sequence.truth(n)) for n in sequence.numbers)
        return cls(sequence.name, sequence.fps, frames, sequence.initial_box)

    @property
    def numbers(self) -> list[int]:
        """Return the frame numbers."""
        return list(range(len(self.frames)))

    def stamp_ns(self, number: int) -> int:
        """Return the stamp of a frame in nanoseconds."""
        return frame_stamp_ns(number, self.fps)

    def image(self, number: int) -> NDArray[np.uint8]:
        """Return a frame as (H, W, 3) uint8 BGR."""
        return self.frames[number][0]

    def truth(self, number: int) -> NDArray[np.uint8] | None:
        """Return the truth of a frame as (H, W) uint8."""
        return self.frames[number][1]

    @cached_property
    def still(self) -> bool:
        """Return whether the camera stands still, by the corners of the first frames."""
        known = [(image, truth) for image, truth in self.frames if truth is not None]
        (first, truth), (later, _) = known[0], known[min(STILL_FRAMES, len(known) - 1)]
        grey = [cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) for image in (first, later)]
        background = np.where(truth == 0, 255, 0).astype(np.uint8)
        corners = cv2.goodFeaturesToTrack(grey[0], 200, 0.01, 5, mask=background)
        if corners is None:
            return True
        moved, found, _ = cv2.calcOpticalFlowPyrLK(grey[0], grey[1], corners, corners.copy())
        way = np.linalg.norm(moved - corners, axis=-1)[found > 0]
        return way.size > 0 and float(np.median(way)) <= STILL_PX

    def changed(self, name: str, change: Callable[[int, Frame], Frame]) -> MadeClip | None:
        """
        Return the clip with every frame changed, and the box that then is about the person.

        :param name: what is added to the clip's name.
        :param change: makes the new frame of its number and the old one.
        :returns: what :meth:`with_frames` makes of them.
        """
        return self.with_frames(name, [change(n, frame) for n, frame in enumerate(self.frames)])

    def with_frames(self, name: str, frames: list[Frame]) -> MadeClip | None:
        """
        Return a clip of other frames; those before the first that shows the person are left out.

        :returns: None if the person is in fewer than two of them.
        """
        boxes = [None if truth is None else start_box(truth) for _, truth in frames]
        seen = [number for number, box in enumerate(boxes) if box is not None]
        if len(seen) < 2:
            return None
        box = boxes[seen[0]]
        assert box is not None
        name = f'{self.name}/{name}' if name else self.name
        return replace(self, name=name, frames=tuple(frames[seen[0] :]), box=box)
