# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Joining messages of several topics on their exact stamp."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any


class ExactJoin:
    """
    Collects the parts that belong to one stamp, to the nanosecond, until they are complete.

    Each part comes in the order of the images: when an entry is complete, those that began before
    it will never be, and are dropped, as is the oldest when too many wait.  The order is not that
    of stamps, which go back where a bag loops.
    """

    def __init__(self, stages: Mapping[str, Iterable[str]], capacity: int) -> None:
        """
        Make an empty join.

        :param stages: the parts that make an entry complete, by the node they come from, in the
            order of the work.
        :param capacity: incomplete entries kept.
        """
        self._stages = {part: stage for stage, parts in stages.items() for part in parts}
        self._first = next(iter(self._stages))
        self.capacity = capacity
        self.dropped: Counter[str] = Counter()
        """
        Entries dropped since the first that was complete, by the node they lacked a part of.

        Without the first part of all an entry is the rest of one that was dropped before.
        """

        self._entries: dict[int, dict[str, Any]] = {}
        self._joined = False

    def __len__(self) -> int:
        """Return the number of incomplete entries."""
        return len(self._entries)

    @property
    def waits_for(self) -> str:
        """Return the first node that the newest entry lacks a part of, empty without one."""
        begun = (each for each in reversed(self._entries.values()) if self._first in each)
        newest = next(begun, None)
        return '' if newest is None else self._lacking(newest)

    def add(self, part: str, stamp_ns: int, value: Any) -> dict[str, Any] | None:
        """
        Take in a part, of which the first of a stamp counts.

        :returns: all parts by name if the stamp is complete now, else None.
        """
        entry = self._entries.setdefault(stamp_ns, {})
        entry.setdefault(part, value)
        if len(entry) == len(self._stages):
            self._joined = True
            while (oldest := next(iter(self._entries))) != stamp_ns:
                self._drop(oldest)
            return self._entries.pop(stamp_ns)
        if len(self._entries) > self.capacity:
            self._drop(next(iter(self._entries)))
        return None

    def _drop(self, stamp_ns: int) -> None:
        entry = self._entries.pop(stamp_ns)
        if self._joined and self._first in entry:
            self.dropped[self._lacking(entry)] += 1

    def _lacking(self, entry: Mapping[str, Any]) -> str:
        """Return the node of the first part that an entry lacks, in the order of the work."""
        return next(stage for part, stage in self._stages.items() if part not in entry)
