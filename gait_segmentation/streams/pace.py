# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How often a computer that cannot keep up does what may be done more rarely."""

from __future__ import annotations

_LEAST = 1 / 4
_EVERY_S = 0.5
"""Time after which it is seen what a change has brought."""

_TOO_MUCH, _ENOUGH = 0.9, 0.6
"""Load from which the pace is halved, and below which it is doubled."""


class Pace:
    """
    A pace that follows the load, from 1, all that is asked for, down to a quarter of it.

    It begins with half of that, so that a computer is not kept busy before its load is known.

    It is halved while frames take about as long as they come, as some then wait for those that
    take longer, and doubled when there is time again, at most every half a second.
    """

    def __init__(self) -> None:
        """Begin in the middle."""
        self.share = 0.5
        self._changed_s: float | None = None

    def update(self, load: float, now_s: float) -> float:
        """
        Return the pace from now on.

        :param load: time that frames take, over that between two.
        :param now_s: steady time.
        """
        if self._changed_s is None:
            self._changed_s = now_s
        if now_s - self._changed_s >= _EVERY_S:
            wanted = self.share
            if load > _TOO_MUCH:
                wanted = max(self.share / 2, _LEAST)
            elif load < _ENOUGH:
                wanted = min(self.share * 2, 1.0)
            if wanted != self.share:
                self.share, self._changed_s = wanted, now_s
        return self.share
