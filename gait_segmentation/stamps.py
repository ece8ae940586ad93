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

_ANEW_S = 1.0
"""A step back that is longer is no late frame: time has been set back, or a bag begins again."""

_REMEMBERED = 1000
"""Stamps that are known to have come."""


class Order(Enum):
    """What the stamp of a frame says about its place among the others."""

    NEXT = 'next'
    """It is later than all before."""

    LATE = 'late'
    """A later one was there before: it is answered, but tells nothing any more."""

    AGAIN = 'again'
    """It has come before, and is to be ignored."""

    ANEW = 'anew'
    """Time begins anew: nothing of what was before counts."""


class Stamps:
    """
    The stamps of a stream of frames.

    A step back of more than a second begins anew, as does the very stamp that the stream began
    with, for short bags that loop.  Other steps back are frames that others have overtaken, as on
    their way through the threads of a driver, or those of a clock that is set.
    """

    def __init__(self) -> None:
        """Begin without any stamp."""
        self.reset()

    def reset(self) -> None:
        """Forget all stamps."""
        self._newest_ns = 0
        self._first_ns = 0
        self._come: deque[int] = deque(maxlen=_REMEMBERED)

    @property
    def newest_ns(self) -> int:
        """Return the latest stamp since time began, 0 without."""
        return self._newest_ns

    def order(self, stamp_ns: int) -> Order:
        """Return how a stamp stands to those taken, without taking it."""
        if stamp_ns > self._newest_ns:
            # Unless it came with a frame that could not be used.
            return Order.AGAIN if stamp_ns in self._come else Order.NEXT
        if stamp_ns == self._newest_ns:
            return Order.AGAIN
        if stamp_ns == self._first_ns or self._newest_ns - stamp_ns > 1e9 * _ANEW_S:
            return Order.ANEW
        return Order.AGAIN if stamp_ns in self._come else Order.LATE

    def take(self, stamp_ns: int) -> Order:
        """Take a stamp, and return how it stands to those before."""
        order = self.order(stamp_ns)
        if order is Order.ANEW:
            self.reset()
        if order in (Order.NEXT, Order.ANEW):
            self._newest_ns = stamp_ns
            self._first_ns = self._first_ns or stamp_ns
        if order is not Order.AGAIN:
            self._come.append(stamp_ns)
        return order

    def note(self, stamp_ns: int) -> None:
        """Note that a frame has come that cannot be used: another with its stamp comes again."""
        if stamp_ns not in self._come:
            self._come.append(stamp_ns)


def check_stamp(stamp_ns: int) -> None:
    """
    Refuse the stamp zero, which would make all frames the same.

    :raises InputError: if the stamp is no integer, or not positive.
    """
    if not isinstance(stamp_ns, int | np.integer):
        # Seconds would be taken for frames at the same time, nearly.
        raise InputError(f'stamp must be whole nanoseconds, got {stamp_ns!r}')
    if stamp_ns <= 0:
        raise InputError(f'stamp must be positive nanoseconds, got {stamp_ns}')


def check_later(stamp_ns: int, before_ns: int) -> None:
    """
    Refuse a stamp that is not later than that of the frame before, 0 without one.

    :raises InputError: if it is not, or is none, see :func:`check_stamp`.
    """
    check_stamp(stamp_ns)
    if stamp_ns <= before_ns:
        raise InputError(f'stamps must increase without a reset, got {stamp_ns} after {before_ns}')


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
