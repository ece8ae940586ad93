# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Joining messages of several topics on their exact stamp."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from gait_segmentation.stamps import Order, Stamps

_REMEMBERED = 1000
"""Entries that were dropped and whose late parts are known as such."""


@dataclass
class _Entry:
    """The parts of a stamp, and how often time had begun anew before they came."""

    stamp_ns: int
    run: int
    parts: dict[str, Any] = field(default_factory=dict)

    @property
    def key(self) -> tuple[int, int]:
        """Return which frame it is of."""
        return self.run, self.stamp_ns


class ExactJoin:
    """
    Collects the parts that belong to one stamp until they are complete.

    All stages copy the source image's header, so stamps agree to the nanosecond and nothing
    needs to be approximated.  Each part comes in the order of the images, whose stamps may be late
    or begin anew (a bag that loops, a simulation that is reset): then its next *run* begins, while
    other parts of the run before may still be on their way.  An entry that a part has passed by
    will never be complete, and is given up; what stays incomplete otherwise is pushed out by what
    comes later.  A part that comes again is ignored.
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
        """Entries given up, by the part that they lacked."""

        self.skipped: Counter[str] = Counter()
        """The same by stage, where neither it nor one after it had said a thing."""

        self.again: Counter[str] = Counter()
        """Parts ignored since their stamp had come before."""

        self.forget()

    def forget(self) -> None:
        """Drop what waits, without counting it, and begin anew."""
        self._entries: list[_Entry] = []
        self._stamps = {part: Stamps() for part in self._stages}
        self._first: dict[str, tuple[int, int]] = {}
        self._runs: dict[str, int] = {}
        self._given_up: deque[tuple[int, int]] = deque(maxlen=_REMEMBERED)
        self._joined = False

    def __len__(self) -> int:
        """Return the number of incomplete entries."""
        return len(self._entries)

    @property
    def waits_for(self) -> str:
        """Return the first stage that the newest entry lacks a part of, empty without entries."""
        return self._stages[self._lacking(self._entries[-1])] if self._entries else ''

    def add(self, part: str, stamp_ns: int, value: Any) -> dict[str, Any] | None:
        """
        Take in a part.

        :returns: all parts by name if the stamp is complete now, else None.
        """
        order = self._stamps[part].take(stamp_ns)
        if order is Order.AGAIN:
            self.again[part] += 1
            return None
        run = self._run(part, stamp_ns, order)
        entry = self._entry(part, stamp_ns)
        if entry is None:
            if (run, stamp_ns) in self._given_up:
                return None
            entry = _Entry(stamp_ns, run)
            self._entries.append(entry)
        entry.parts[part] = value
        # Not before all are known to go together.
        if self._joined:
            self._drop_passed(entry, part, order)
        complete = len(entry.parts) == len(self._stages)
        if complete:
            self._entries.remove(entry)
            self._joined = True
        if len(self._entries) > self.capacity:
            self._give_up(self._entries[0], self._lacking(self._entries[0]))
        return entry.parts if complete else None

    def _run(self, part: str, stamp_ns: int, order: Order) -> int:
        """Return the run of a part that has come."""
        if part not in self._runs:
            # Time may have begun anew for the others before.
            self._runs[part] = max(self._runs.values(), default=0)
            self._first[part] = (self._runs[part], stamp_ns)
        self._runs[part] += order is Order.ANEW
        return self._runs[part]

    def _entry(self, part: str, stamp_ns: int) -> _Entry | None:
        """Return the entry that a part goes to: the newest, whatever run that is of."""
        for entry in reversed(self._entries):
            if entry.stamp_ns == stamp_ns and (
                part not in entry.parts or entry.run == self._runs[part]
            ):
                return entry
        return None

    def _drop_passed(self, entry: _Entry, part: str, order: Order) -> None:
        """Drop entries that will not be complete, now that a part has come for one."""
        run = self._runs[part]
        if order is Order.ANEW:
            passed = [each for each in self._entries if each.run < run]
        elif order is Order.NEXT:
            # What came in later is late itself.
            before = self._entries[: self._entries.index(entry)]
            stamp_ns = entry.stamp_ns
            passed = [each for each in before if each.run == run and each.stamp_ns < stamp_ns]
        else:
            # Those before it still come.
            return
        for each in passed:
            if part not in each.parts:
                self._give_up(each, part)
        for other in self._stages:
            newest = self._runs[other], self._stamps[other].newest_ns
            if other not in entry.parts and entry.run == newest[0] and entry.key < newest:
                self._give_up(entry, other)
                return

    def _give_up(self, entry: _Entry, part: str) -> None:
        """Drop an entry for the lack of a part; count it if that had ever come before."""
        self._entries.remove(entry)
        self._given_up.append(entry.key)
        if part not in self._first or entry.key < self._first[part]:
            return
        stage = self._stages[part]
        after = self._order[self._order.index(stage) :]
        if any(self._stages[each] in after for each in entry.parts):
            self.missed[part] += 1
        else:
            self.skipped[stage] += 1

    def _lacking(self, entry: _Entry) -> str:
        """Return the first part that an entry lacks, in the order of the work."""
        return next(part for part in self._stages if part not in entry.parts)
