# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Warnings that do not flood the log, of frames above all."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

from gait_segmentation.streams.join import ExactJoin

__all__ = ['Warnings', 'shortened']

_EVERY_S = 5.0

_LONGEST = 400
"""Characters of a line: names and numbers in messages may be of any length."""


def shortened(text: str) -> str:
    """Return a text as far as a line of a log should hold it."""
    return text if len(text) <= _LONGEST else f'{text[:_LONGEST]} ... ({len(text)} characters)'


class Warnings:
    """
    The warnings of a node, of which those of one key are logged at most every 5 seconds.

    Frames that nothing could be said of meanwhile are counted in when something is said again.
    """

    def __init__(self, log: Callable[[str], object], clock: Callable[[], float]) -> None:
        """Begin with nothing said; ``log`` takes texts, ``clock`` is steady and in seconds."""
        self._log = log
        self._clock = clock
        self._said_s: dict[str, float] = {}
        self._untold: Counter[str] = Counter()

    @property
    def keys(self) -> set[str]:
        """Return the keys of which something was said."""
        return set(self._said_s)

    def warn(self, key: str, text: str) -> bool:
        """Log a warning unless one of its key was logged just before; return whether it was."""
        now_s = self._clock()
        if now_s - self._said_s.get(key, -_EVERY_S) < _EVERY_S:
            return False
        self._said_s[key] = now_s
        self._log(shortened(text))
        return True

    def warn_of(self, frames: int, text: str) -> None:
        """
        Log a warning about some frames.

        :param text: the key as well; ``{}`` stands for these frames and those not told of before.
        """
        self._untold[text] += frames
        count = self._untold[text]
        if self.warn(text, text.format(f'{count} frame{"s" * (count != 1)}')):
            del self._untold[text]

    def warn_of_missed(self, join: ExactJoin, remedy: str = '') -> None:
        """
        Log warnings about frames of which not all parts have come.

        :param remedy: what gives more room to those that wait, if anything does.
        """
        skipped = (
            '{} said nothing of {{}}, so there is no result: it skipped them (its log says why), '
            'is disabled, or was not there'
        )
        missed = (
            '{} did not come for {{}}: its publisher left them out, or they were lost on the way'
        )
        late = (
            '{} had not come for {{}} when there was no room for more than '
            f'{join.capacity} that wait' + (f': {remedy}' if remedy else '')
        )
        for text, counts in ((skipped, join.skipped), (missed, join.missed), (late, join.late)):
            for who, count in counts.items():
                self.warn_of(count, text.format(who))
