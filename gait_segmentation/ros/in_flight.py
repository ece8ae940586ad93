# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a node may run ahead of what comes back to it."""

from __future__ import annotations

from collections import deque

__all__ = ['InFlight']

_REMEMBERED = 1000


class InFlight:
    """
    The frames passed on whose feedback has not come back.

    A node that learns from feedback gains nothing by running far ahead of it: the frames would
    only wait elsewhere, and the feedback come when it is too old to be learnt from.  Where no
    feedback comes, or all of it late by more than the limit, nothing is held.
    """

    def __init__(self, limit: int) -> None:
        """Begin with nothing in flight; from ``limit`` frames on it is full."""
        self._limit = limit
        self._stamps: deque[int] = deque(maxlen=_REMEMBERED)
        self._answered = False

    @property
    def full(self) -> bool:
        """Return whether feedback should come before the next frame."""
        return self._answered and len(self._stamps) >= self._limit

    def add(self, stamp_ns: int) -> None:
        """Take note of a frame that is passed on."""
        self._stamps.append(stamp_ns)

    def answered(self, stamp_ns: int) -> None:
        """Take note of feedback; frames before it will have none any more."""
        if stamp_ns not in self._stamps:
            return
        while self._stamps.popleft() != stamp_ns:
            pass
        if len(self._stamps) < self._limit:
            self._answered = True

    def give_up(self) -> None:
        """Hold nothing until feedback comes in time again."""
        self._answered = False

    def clear(self) -> None:
        """Forget all frames."""
        self._stamps.clear()
