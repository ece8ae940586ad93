# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames kept until their results come, which a lag holds back."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from typing import Generic, Protocol, TypeVar

__all__ = ['HeldFrames']


class Stamped(Protocol):
    """What says to which frame it belongs."""

    @property
    def stamp_ns(self) -> int:
        """Return the stamp of the frame."""


Frame = TypeVar('Frame')
Result = TypeVar('Result', bound=Stamped)


class HeldFrames(Generic[Frame]):
    """
    A queue of frames by stamp, from which results take theirs.

    Results come in the order of the frames; one that has none is passed over by the next.
    """

    def __init__(self) -> None:
        """Hold nothing."""
        self._frames: deque[tuple[int | None, Frame]] = deque()

    def __len__(self) -> int:
        """Return the number of frames held."""
        return len(self._frames)

    def hold(self, stamp_ns: int | None, frame: Frame) -> None:
        """Keep a frame by the stamp that its result will have, None if there will be none."""
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

    def answered(
        self, results: Iterable[Result], *, last: bool = False
    ) -> Iterator[tuple[Frame, Result | None]]:
        """
        Yield frames in their order with their results, None for those that are passed over.

        Results of frames that are not held, such as a second one, are left out.

        :param last: whether nothing more comes, so that all that are left have no result.
        """
        for result in results:
            while any(stamp_ns == result.stamp_ns for stamp_ns, _ in self._frames):
                stamp_ns, frame = self._frames.popleft()
                yield frame, result if stamp_ns == result.stamp_ns else None
        while self._frames and (last or self._frames[0][0] is None):
            yield self._frames.popleft()[1], None

    def clear(self) -> None:
        """Let go of all frames."""
        self._frames.clear()
