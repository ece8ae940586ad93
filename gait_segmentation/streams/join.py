# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Joining messages of several topics on their exact stamp."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterable, Mapping
from typing import Any


class ExactJoin:
    """
    Collects the parts that belong to one stamp until they are complete.

    All stages copy the source image's header, so stamps agree to the nanosecond and nothing
    needs to be approximated.  Each part comes in the order of the images: when an entry is
    complete, those that began before it will never be, and are dropped, as is the oldest when
    too many wait.  The order is that in which entries began, not that of stamps, which go back
    where a bag loops.
    """

    def __init__(self, stages: Mapping[str, Iterable[str]], capacity: int) -> None:
        """
        Make an empty join.

        :param stages: the parts that make an entry complete, by the node they come from, in the
            order of the work.
        :param capacity: incomplete entries kept.
        """
        self._stages = {part: stage for stage, parts in stages.items() for part in parts}
        self._order = list(stages)
        self.capacity = capacity
        self.missed: Counter[str] = Counter()
        """Entries dropped, by the part that they lacked."""

        self.skipped: Counter[str] = Counter()
        """The same by stage, where neither it nor one after it had said a thing."""

        self.stale = 0
        """Parts ignored since their stamp had come before."""

        self._entries: dict[int, dict[str, Any]] = {}
        self._dropped: deque[int] = deque(maxlen=10 * self.capacity)
        self._come: set[str] = set()
        self._early: set[int] = set()

    def __len__(self) -> int:
        """Return the number of incomplete entries."""
        return len(self._entries)

    @property
    def waits_for(self) -> str:
        """Return the first stage that the newest entry lacks a part of, empty without entries."""
        newest = next(reversed(self._entries.values()), None)
        return '' if newest is None else self._stages[self._lacking(newest)]

    def add(self, part: str, stamp_ns: int, value: Any) -> dict[str, Any] | None:
        """
        Take in a part.

        :returns: all parts by name if the stamp is complete now, else None.
        """
        if part not in self._come:
            # Who sends it may just have started: what began before is no loss.
            self._come.add(part)
            self._early.update(self._entries)
        if stamp_ns in self._dropped:
            return None
        entry = self._entries.setdefault(stamp_ns, {})
        if part in entry:
            self.stale += 1
            return None
        entry[part] = value
        if len(entry) == len(self._stages):
            while (oldest := next(iter(self._entries))) != stamp_ns:
                self._drop(oldest)
            del self._entries[stamp_ns]
            self._early.discard(stamp_ns)
            return entry
        if len(self._entries) > self.capacity:
            self._drop(next(iter(self._entries)))
        return None

    def _drop(self, stamp_ns: int) -> None:
        """Drop an entry, and count it if what it lacks had ever come before it began."""
        entry = self._entries.pop(stamp_ns)
        self._dropped.append(stamp_ns)
        part = self._lacking(entry)
        if part not in self._come or stamp_ns in self._early:
            self._early.discard(stamp_ns)
            return
        after = self._order[self._order.index(self._stages[part]) :]
        if any(self._stages[each] in after for each in entry):
            self.missed[part] += 1
        else:
            self.skipped[self._stages[part]] += 1

    def _lacking(self, entry: Mapping[str, Any]) -> str:
        """Return the first part that an entry lacks, in the order of the work."""
        return next(part for part in self._stages if part not in entry)
