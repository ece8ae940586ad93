# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What all hostile messages have in common, and the table of their kinds."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from std_msgs.msg import Header

__all__ = ['BAD', 'GOOD', 'KINDS', 'Aim', 'Call', 'Kind', 'Shot', 'header', 'kind']

GOOD, BAD = 'good', 'bad'
"""The frame_id of frames that must be answered, and of all others."""

STEP_NS = 33_333_337


@dataclass(frozen=True)
class Shot:
    """A message, or the bytes of one as DDS has them, for a topic of both graphs."""

    topic: str
    message: Any


@dataclass(frozen=True)
class Call:
    """
    A request to a service of a node.

    With ``pauses`` the node may take no frames before the next call is answered, so that no frame
    that is to be answered may be on its way.
    """

    node: str
    service: str
    request: Any
    pauses: bool = False


class Aim:
    """What a hostile message is made from: dice, and the frames that are shown meanwhile."""

    def __init__(self, rng: np.random.Generator, images: list[NDArray[np.uint8]]) -> None:
        """
        Begin before the first frame.

        :param images: (h, w, 3) uint8 BGR, the film that is shown over and over.
        """
        self.rng = rng
        self.number = 0
        self._there_and_back = [*images, *images[-2:0:-1]]
        self._shots = 0

    @property
    def image(self) -> NDArray[np.uint8]:
        """Return the picture of the newest good frame, (h, w, 3) uint8."""
        return self._there_and_back[self.number % len(self._there_and_back)]

    @property
    def stamp_ns(self) -> int:
        """Return the stamp of the newest good frame."""
        return 1_000_000_000_000 + self.number * STEP_NS

    def advance(self) -> None:
        """Go on to the next good frame."""
        self.number += 1
        self._shots = 0

    def fresh(self) -> Header:
        """Return the header of a frame after the newest good one, and before the next."""
        self._shots = min(self._shots + 1, 600)
        return header(self.stamp_ns + self._shots * 50_000)

    def one_of(self, values: Iterable[Any]) -> Any:
        """Return one of some values."""
        among = list(values)
        return among[self.rng.integers(len(among))]

    def size(self, least: int = 1, most: int = 200) -> tuple[int, int]:
        """Return a width and a height."""
        width, height = self.rng.integers(least, most + 1, 2)
        return int(width), int(height)

    def noise(self, *shape: int) -> NDArray[np.uint8]:
        """Return random bytes."""
        return self.rng.integers(0, 256, shape, dtype=np.uint8)

    def some_changed(self, data: bytes, begin: int, end: int) -> bytes:
        """Return data of which up to eight bytes within the beginning are others."""
        made = bytearray(data)
        for at in self.rng.integers(begin, min(len(made), end), self.rng.integers(1, 9)):
            made[at] = self.rng.integers(256)
        return bytes(made)

    def cut(self, data: bytes) -> bytes:
        """Return data without its end."""
        return data[: int(self.rng.integers(4, len(data)))]


Kind: TypeAlias = Callable[[Aim], Iterable[Shot | Call]]

KINDS: dict[str, tuple[Kind, float]] = {}
"""What makes the messages of a kind, and how often that is chosen beside the others."""


def kind(name: str, weight: float = 1.0) -> Callable[[Kind], Kind]:
    """Enter a function into the table of kinds."""

    def enter(function: Kind) -> Kind:
        assert name not in KINDS, name
        KINDS[name] = (function, weight)
        return function

    return enter


def header(stamp_ns: int, frame_id: str = BAD) -> Header:
    """Return a header with a stamp."""
    made = Header(frame_id=frame_id)
    made.stamp.sec, made.stamp.nanosec = divmod(stamp_ns, 1_000_000_000)
    return made
