# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A look at the whole image now and then, by a network that nothing here has taught."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.detector.person_detector import Detection

_CALM_NS, _URGENT_NS = 400_000_000, 100_000_000
"""Time between two looks while all is well, and while somebody is looked for."""

_NICENESS = 10

Detect = Callable[[NDArray[np.uint8]], Sequence[Detection]]


@dataclass(frozen=True)
class Sighting:
    """Who was seen in the frame of a stamp."""

    stamp_ns: int
    people: tuple[Detection, ...]


class Lookout:
    """
    Decides which frames a detector looks at, and has it look.

    In lockstep it looks at once, so that every run gives the same bits.  With a thread of its own
    no frame waits for it: it looks at the newest frame when it has done with the last one, and
    what it saw comes some frames late.
    """

    def __init__(self, detect: Detect, *, threaded: bool = False) -> None:
        """
        Prepare for the first frame.

        :param detect: see :meth:`PersonDetector.people`.
        """
        self._detect = detect
        self.pool = ThreadPoolExecutor(1, 'lookout', _give_way) if threaded else None
        self.reset()

    def reset(self) -> None:
        """Look at the next frame, whatever its stamp is."""
        self._last_ns: int | None = None
        self._running: Future[Sighting] | None = None

    def look(self, image: NDArray[np.uint8], stamp_ns: int, *, urgent: bool) -> Sighting | None:
        """
        Take in a frame.

        :param image: (H, W, 3) uint8 BGR; with a thread it must not be written to any more.
        :param stamp_ns: its stamp.
        :param urgent: whether somebody is missing.
        :returns: what was seen since the last call, in this frame or one before, if there was a
            look.
        """
        seen = None
        if self._running is not None:
            if not self._running.done():
                return None
            seen, self._running = self._running.result(), None
        period = _URGENT_NS if urgent else _CALM_NS
        if self._last_ns is not None and stamp_ns - self._last_ns < period:
            return seen
        self._last_ns = stamp_ns
        if self.pool is None:
            return self._sighting(image, stamp_ns)
        self._running = self.pool.submit(self._sighting, image, stamp_ns)
        return seen

    def _sighting(self, image: NDArray[np.uint8], stamp_ns: int) -> Sighting:
        return Sighting(stamp_ns, tuple(self._detect(image)))


def _give_way() -> None:
    """Let the threads that frames wait for go first, where that can be had (Linux)."""
    with suppress(OSError, AttributeError):
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _NICENESS)
