# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames kept until their results come, which a lag holds back."""

from __future__ import annotations

from collections import deque
from typing import Generic, TypeVar

__all__ = ['HeldFrames']

Frame = TypeVar('Frame')


class HeldFrames(Generic[Frame]):
    """
    A queue of frames by stamp, from which results take theirs.

    Results come in the order of the frames; one that has none is passed over by the next.
    """

    def __init__(self) -> None:
        """Hold nothing."""
        self._frames: deque[tuple[int, Frame]] = deque()

    def __len__(self) -> int:
        """Return the number of frames held."""
        return len(self._frames)

    def hold(self, stamp_ns: int, frame: Frame) -> None:
        """Keep a frame, the stamp of which identifies it."""
        self._frames.append((stamp_ns, frame))

    def take(self, stamp_ns: int) -> Frame:
        """
        Return the frame of a stamp and let go of it and of all before.

        :raises IndexError: if it is not held.
        """
        held_ns, frame = self._frames.popleft()
        while held_ns != stamp_ns:
            held_ns, frame = self._frames.popleft()
        return frame

    def clear(self) -> None:
        """Let go of all frames."""
        self._frames.clear()
