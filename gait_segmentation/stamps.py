# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How the stamp of a frame stands to those before: the one place that decides it."""

from __future__ import annotations

from collections import deque
from enum import Enum

__all__ = ['Order', 'Stamps']

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
