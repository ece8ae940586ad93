# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A look at the whole image now and then, by networks that nothing here has taught."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.detector.networks import BOXES, DetectorConfig, Networks, open_networks
from gait_segmentation.detector.person_detector import Detection
from gait_segmentation.errors import GaitSegmentationError

_NICENESS = 10


@dataclass(frozen=True)
class Sighting:
    """
    What was seen in the frame of a stamp.

    ``people`` is None where nobody was looked for; ``heat_map`` is (h, w) uint8, P(person), if
    there is a network for that; ``error`` says why nothing can be seen.
    """

    stamp_ns: int
    people: tuple[Detection, ...] | None
    heat_map: NDArray[np.uint8] | None = None
    seconds: float = 0.0
    error: str = ''


class Lookout:
    """
    Decides which frames the networks look at, and has them look.

    In lockstep they look at once, so that every run gives the same bits.  With threads of its own
    no frame waits for them: they look at the newest frame when they have done with the last one,
    and what they saw comes some frames late.
    """

    def __init__(
        self,
        config: DetectorConfig | None = None,
        networks: Networks | None = None,
        *,
        threaded: bool = False,
        clock: Callable[[], float] = float,
    ) -> None:
        """
        Prepare for the first frame.

        :param networks: what looks; if None that of the configuration, loaded at the first look.
        :param clock: seconds for the sightings, e.g. ``time.perf_counter``.
        """
        self._config = config or DetectorConfig()
        self._networks = networks
        self._lock = threading.Lock()
        self.pools: tuple[ThreadPoolExecutor, ThreadPoolExecutor] | None = None
        if threaded:
            # While somebody is missing, frames have less to lose by it.
            self.pools = ThreadPoolExecutor(1, 'calm', _give_way), ThreadPoolExecutor(1, 'urgent')
        self._clock = clock
        self._blind = False
        self._people: tuple[Detection, ...] | None = None
        self.reset()

    def reset(self) -> None:
        """Look at the next frame, whatever its stamp is."""
        self._last_ns: int | None = None
        self._running: Future[Sighting] | None = None
        self._fresh = True
        self.newest: Sighting | None = None
        """The newest that says who is there, if any does, for the diagnostics."""

    def look(
        self, image: NDArray[np.uint8], stamp_ns: int, *, boxes: bool = True, urgent: bool
    ) -> Sighting | None:
        """
        Take in a frame.

        :param image: (H, W, 3) uint8 BGR; with a thread it must not be written to any more.
        :param stamp_ns: its stamp.
        :param boxes: whether it is asked who is in the image.
        :param urgent: whether somebody is missing.
        :returns: what was seen since the last call, in this frame or one before, if there was a
            look.
        :raises DetectorError: if a network cannot be loaded, or gives what it must not; with a
            thread the sighting says so.
        """
        seen = None
        if self._running is not None:
            if not self._running.done():
                return None
            seen, self._running = self._running.result(), None
            if seen.people is not None or seen.error or self.newest is None:
                self.newest = seen
        # Which networks a file has is known once it is loaded.
        mapper = None if self._networks is None else self._networks.mapper
        draws = mapper is not None or (self._networks is None and self._config.network != BOXES)
        needed = mapper is not None and mapper.needs_people
        period_s = self._config.calm_period
        if urgent or needed:
            period_s = self._config.urgent_period
        passed = self._last_ns is None or stamp_ns - self._last_ns >= round(1e9 * period_s)
        due = (boxes or needed) and passed
        if self._blind or not (due or draws):
            return seen
        if due:
            self._last_ns = stamp_ns
        fresh, self._fresh = self._fresh, False
        if self.pools is None:
            self.newest = self._sighting(image, stamp_ns, due, fresh)
            return self.newest
        self._running = self.pools[urgent].submit(self._tried, image, stamp_ns, due, fresh)
        return seen

    def _tried(self, image: NDArray[np.uint8], stamp_ns: int, due: bool, fresh: bool) -> Sighting:
        try:
            with self._lock:
                # Who is there is told before they are drawn, in the next image: neither is late.
                return self._sighting(image, stamp_ns, due, fresh, draw=not due)
        except GaitSegmentationError as error:
            self._blind = self._networks is None
            return Sighting(stamp_ns, None, error=str(error))

    def _sighting(
        self,
        image: NDArray[np.uint8],
        stamp_ns: int,
        due: bool,
        fresh: bool,
        *,
        draw: bool = True,
    ) -> Sighting:
        if self._networks is None:
            self._networks = open_networks(self._config.network)
        started = self._clock()
        mapper, people, heat_map = self._networks.mapper, None, None
        if due or (mapper is not None and mapper.needs_people and fresh):
            people = tuple(self._networks.people(image))
        if mapper is not None:
            if fresh:
                mapper.reset()
            self._people = people if people is not None else self._people
            if draw:
                heat_map, self._people = mapper.draw(image, self._people), None
        return Sighting(stamp_ns, people, heat_map, self._clock() - started)


def _give_way() -> None:
    """Let the threads that frames wait for go first, where that can be had (Linux)."""
    with suppress(OSError, AttributeError):
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _NICENESS)
