# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Joining messages of several topics on their exact stamp."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from gait_segmentation.errors import ConfigError

__all__ = ['ExactJoin']


class ExactJoin:
    """
    Collects the parts that belong to one stamp until they are complete.

    All stages copy the source image's header, so stamps agree to the nanosecond and nothing
    needs to be approximated.  What stays incomplete is pushed out by what comes later, in the
    order of arrival and not of stamps, so that a clock that jumps back does no harm.
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
        self._entries: dict[int, dict[str, Any]] = {}
        self._newest: dict[str, int] = {}

    def __len__(self) -> int:
        """Return the number of incomplete entries."""
        return len(self._entries)

    def clear(self) -> None:
        """Forget all incomplete entries."""
        self._entries.clear()
        self._newest.clear()

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
            stale = [stamp for stamp, entry in self._entries.items() if part in entry]
            for stamp in stale:
                del self._entries[stamp]
        self._newest[part] = stamp_ns
        entry = self._entries.setdefault(stamp_ns, {})
        entry[part] = value
        if len(entry) == len(self.parts):
            del self._entries[stamp_ns]
            return entry
        if len(self._entries) > self.capacity:
            del self._entries[next(iter(self._entries))]
        return None
