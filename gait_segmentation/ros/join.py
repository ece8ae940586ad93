# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Joining messages of several topics on their exact stamp."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from gait_segmentation.errors import ConfigError

__all__ = ['ExactJoin']


@dataclass
class _Entry:
    """The parts of a stamp, and how often the stamps had jumped back before they came."""

    parts: dict[str, Any] = field(default_factory=dict)
    run: int = 0


class ExactJoin:
    """
    Collects the parts that belong to one stamp until they are complete.

    All stages copy the source image's header, so stamps agree to the nanosecond and nothing
    needs to be approximated.  Each part comes in the order of its stamps: an entry that a part
    has passed by will never be complete, and is dropped and counted.  What stays incomplete
    otherwise is pushed out by what comes later, in the order of arrival and not of stamps, so that
    a clock that jumps back does no harm.
    """

    def __init__(self, parts: Iterable[str], capacity: int) -> None:
        """
        Make an empty join.

        :param parts: names of the parts that make an entry complete.
        :param capacity: incomplete entries kept.
        :raises ConfigError: if there is no part or no room.
        """
        self.parts = frozenset(parts)
        if not self.parts or capacity < 1:
            raise ConfigError(
                f'a join needs parts and a capacity of at least 1, got {sorted(self.parts)} '
                f'and {capacity}'
            )
        self.capacity = capacity
        self.missed: Counter[str] = Counter()
        """Entries dropped, by the part that passed them by."""

        self._entries: dict[int, _Entry] = {}
        self._newest: dict[str, int] = {}
        self._runs: Counter[str] = Counter()
        self._given_up: deque[tuple[int, int]] = deque(maxlen=capacity)
        self._joined = False

    def __len__(self) -> int:
        """Return the number of incomplete entries."""
        return len(self._entries)

    def clear(self) -> None:
        """Forget all incomplete entries."""
        self._entries.clear()
        self._newest.clear()
        self._runs.clear()
        self._given_up.clear()
        self._joined = False
        self.missed.clear()

    def add(self, part: str, stamp_ns: int, value: Any) -> dict[str, Any] | None:
        """
        Take in a part.

        :returns: all parts by name if the stamp is complete now, else None.

        A part whose stamps jump back (a bag that loops, a simulation that is reset) drops the
        entries it was in before: they are of another run.  Entries it was not in are kept, since
        the other topics may have jumped already.
        """
        if part not in self.parts:
            raise KeyError(f'part must be one of {", ".join(sorted(self.parts))}, got {part!r}')
        if stamp_ns < self._newest.get(part, stamp_ns):
            stale = [stamp for stamp, entry in self._entries.items() if part in entry.parts]
            for stamp in stale:
                del self._entries[stamp]
            self._runs[part] += 1
        self._newest[part] = stamp_ns
        run = self._runs[part]
        if self._given_up and (stamp_ns, run) in self._given_up:
            return None
        for stamp, entry in list(self._entries.items()):
            if stamp < stamp_ns and part not in entry.parts and self._passes(part, entry):
                self._give_up(stamp, part)
        entry = self._entries.setdefault(stamp_ns, _Entry())
        entry.parts[part] = value
        entry.run = max(entry.run, run)
        for other in self.parts - entry.parts.keys():
            if self._newest.get(other, 0) > stamp_ns and self._passes(other, entry):
                self._give_up(stamp_ns, other)
                return None
        if len(entry.parts) == len(self.parts):
            del self._entries[stamp_ns]
            self._joined = True
            return entry.parts
        if len(self._entries) > self.capacity:
            del self._entries[next(iter(self._entries))]
        return None

    def _passes(self, part: str, entry: _Entry) -> bool:
        """Return whether a part with a later stamp says that it will not come."""
        # Not before all are known to go together, nor when others have jumped back already.
        return self._joined and self._runs[part] == entry.run

    def _give_up(self, stamp_ns: int, part: str) -> None:
        """Drop an entry that a part has passed by, and what may still come of it."""
        self.missed[part] += 1
        self._given_up.append((stamp_ns, self._entries.pop(stamp_ns).run))
