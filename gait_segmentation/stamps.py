# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Stamps of frames: how one stands to those before, and which frame a result belongs to.

Stamps are positive nanoseconds.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from enum import Enum
from typing import Generic, Protocol, TypeVar

import numpy as np

from gait_segmentation.errors import InputError

# A step back that is longer is no late frame: time was set back, or a bag begins again.
_RESET_S = 1.0

LEAST_STEP_NS = 200_000
"""The least from one frame to the next."""


class Order(Enum):
    """What a stamp says: its frame is next, too late, or far back, and all before is void."""

    NEXT = 'next'
    STALE = 'stale'
    RESET = 'reset'


class Stamps:
    """The latest stamp of a stream of frames, ``newest_ns``, 0 without one."""

    newest_ns = 0

    def order(self, stamp_ns: int) -> Order:
        """Return how a stamp stands to those taken, without taking it."""
        if stamp_ns > self.newest_ns:
            return Order.NEXT
        return Order.RESET if self.newest_ns - stamp_ns > 1e9 * _RESET_S else Order.STALE

    def take(self, stamp_ns: int) -> Order:
        """Take a stamp, and return how it stands to those before."""
        order = self.order(stamp_ns)
        if order is not Order.STALE:
            self.newest_ns = stamp_ns
        return order


def check_stamp(stamp_ns: int) -> None:
    """Raise InputError if a stamp is no integer or not positive: with zero all are one frame."""
    if not isinstance(stamp_ns, int | np.integer):
        # Seconds would be taken for frames at the same time, nearly.
        raise InputError(f'stamp must be whole nanoseconds, got {stamp_ns!r}')
    if stamp_ns <= 0:
        raise InputError(f'stamp must be positive nanoseconds, got {stamp_ns}')


def check_later(stamp_ns: int, before_ns: int) -> None:
    """
    Refuse a stamp that is not later than that of the frame before, 0 without one.

    :raises InputError: if it is not, or is none, see :func:`check_stamp`, or no camera can be so
        fast, as where frames are counted or other units are given.
    """
    check_stamp(stamp_ns)
    if stamp_ns <= before_ns:
        raise InputError(f'stamps must increase without a reset, got {stamp_ns} after {before_ns}')
    if before_ns and stamp_ns - before_ns < LEAST_STEP_NS:
        raise InputError(
            f'stamps must be nanoseconds, at least {LEAST_STEP_NS} apart, got {stamp_ns} after '
            f'{before_ns}: are they frame numbers, or in us or ms?'
        )


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
        self._frames: deque[tuple[int | None, Frame]] = deque()

    def __len__(self) -> int:
        """Return the number of frames held."""
        return len(self._frames)

    def hold(self, stamp_ns: int | None, frame: Frame) -> None:
        """Keep a frame by the stamp that its result will have, None if there will be none."""
        self._frames.append((stamp_ns, frame))

    def take(self, stamp_ns: int) -> Frame:
        """Let go of the frame of a stamp, and all before; IndexError if it is not held."""
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
