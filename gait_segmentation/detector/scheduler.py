# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""When the networks look at whole images, and what they see."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.detector.detection import Detection, SoftMask, merged
from gait_segmentation.detector.networks import NONE, DetectorConfig, Networks, open_networks
from gait_segmentation.errors import GaitSegmentationError
from gait_segmentation.geometry import Box

_NICENESS = 10

_EARLY_NS = 2_000_000
"""What a frame may come too early for a look: stamps are rounded, and cameras not exact."""

_LOOKS_LATER = 2.0
"""Share of the looks that there is still time for, over that of the masks, 1 at most."""

_MOST_UNSURE = 2
"""People at whom one look looks closely."""

_MOST_DRAWN = 5
"""People who are drawn in one image."""


@dataclass(frozen=True)
class Detections:
    """
    What the networks saw in the frame of a stamp.

    ``people`` are those of a detector, None where it did not look, of any height from
    ``least_share`` of the longer side on; ``heat_map`` is (h, w) uint8, P(person) of any of them,
    if there is a network for that, and ``error`` says why nothing can be seen.
    """

    stamp_ns: int
    people: tuple[Detection, ...] | None
    heat_map: NDArray[np.uint8] | None = None
    least_share: float = 0.0
    seconds: float = 0.0
    error: str = ''


class DetectorScheduler:
    """
    Decides which frames the networks look at, and has them look.

    In lockstep they look at once, so that every run gives the same bits.  With threads of its own
    no frame waits for a look: they look at the newest frame when they have done with the last one,
    and what they saw comes some frames late.  Masks are always drawn at once: one that is late
    costs more than the time it takes, as limbs have gone on.
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
        :param clock: seconds for the detections, e.g. ``time.perf_counter``.
        """
        self._config = config or DetectorConfig()
        self._networks = networks
        self._lock = threading.Lock()
        self.pools: tuple[ThreadPoolExecutor, ThreadPoolExecutor] | None = None
        if threaded:
            # While somebody is missing, frames have less to lose by it.
            self.pools = ThreadPoolExecutor(1, 'calm', _give_way), ThreadPoolExecutor(1, 'urgent')
        self._clock = clock
        self.pace = 1.0
        """Share of the masks asked for that a busy computer has time for; looks go on longer."""

        self.reset()

    def reset(self) -> None:
        """Look at the next frame, whatever its stamp is."""
        self._blind = False
        self._last_ns: int | None = None
        self._close_ns: int | None = None
        self._drawn_ns: int | None = None
        self._masks = float(_MOST_DRAWN)
        self._running: Future[Detections] | None = None
        self.newest: Detections | None = None
        """The newest that say who is there, if any do, for the diagnostics."""

    def load(self) -> str:
        """Load the networks, as else the first look does; return why not, if they cannot be."""
        try:
            with self._lock:
                self._open()
        except GaitSegmentationError as error:
            return str(error)
        return ''

    def _open(self) -> Networks:
        if self._networks is None:
            self._networks = open_networks(self._config.network, self._config.person_class)
        return self._networks

    def _at_hand(self) -> Networks | None:
        """Return the networks; with threads None until one of them has loaded them."""
        return self._open() if self.pools is None else self._networks

    def look(
        self,
        image: NDArray[np.uint8],
        stamp_ns: int,
        *,
        boxes: bool = True,
        urgent: bool,
        small: bool = False,
        unsure: Sequence[Box] = (),
    ) -> Detections | None:
        """
        Take in a frame.

        :param image: (H, W, 3) uint8 BGR; with a thread it must not be written to any more.
        :param stamp_ns: its stamp.
        :param boxes: whether it is asked who is in the image.
        :param urgent: whether somebody is missing.
        :param small: whether small people are to be seen, too.
        :param unsure: where somebody may be who is to be looked at closely.
        :returns: what was seen since the last call, in this frame or one before, if there was a
            look.
        :raises DetectorError: if a network cannot be loaded, or gives what it must not; with a
            thread the detections say so.
        """
        seen = None
        if self._running is not None:
            if not self._running.done():
                return None
            seen, self._running = self._running.result(), None
            if seen.people is not None or seen.error or self.newest is None:
                self.newest = seen
        config = self._config
        if self._blind or config.network == NONE:
            return seen
        networks = self._at_hand()
        period_s = config.urgent_period if urgent else config.calm_period
        due = boxes and self._is_over(period_s, self._last_ns, stamp_ns)
        close = due and small and self._is_over(config.close_period, self._close_ns, stamp_ns)
        if not (due or (networks is not None and networks.heat_map is not None)):
            return seen
        if due:
            self._last_ns = stamp_ns
        if close:
            self._close_ns = stamp_ns
        see = partial(self._detections, image, stamp_ns, due, close, unsure)
        if self.pools is None:
            self.newest = see()
            return self.newest
        self._running = self.pools[urgent].submit(self._tried, see, stamp_ns)
        return seen

    def _is_over(self, period_s: float, last_ns: int | None, stamp_ns: int) -> bool:
        """Return whether a time has passed since something was done, if it was."""
        due_ns = 1e9 * period_s / min(_LOOKS_LATER * self.pace, 1.0) - _EARLY_NS
        return last_ns is None or stamp_ns - last_ns >= due_ns

    def draw(
        self,
        image: NDArray[np.uint8],
        stamp_ns: int,
        people: Sequence[Box],
        *,
        always: bool = False,
    ) -> list[SoftMask]:
        """
        Draw people in a frame, the first of them, as many as there is time for.

        :param image: (H, W, 3) uint8 BGR.
        :param stamp_ns: its stamp.
        :param people: the boxes about them, who needs a mask most first.
        :param always: whether all are to be drawn now, and others later for it.
        :raises DetectorError: in lockstep, if the networks cannot be loaded.
        """
        since_s = 0.0 if self._drawn_ns is None else (stamp_ns - self._drawn_ns) / 1e9
        rate = self.pace * self._config.mask_rate
        self._masks, self._drawn_ns = min(self._masks + rate * since_s, _MOST_DRAWN), stamp_ns
        networks = self._at_hand() if people else None
        if networks is None or networks.masks is None:
            return []
        most = len(people) if always else max(int(self._masks), 0)
        drawn = [networks.masks.draw(image, box) for box in people[:most]]
        self._masks -= len(drawn)
        return drawn

    def _tried(self, see: Callable[[], Detections], stamp_ns: int) -> Detections:
        try:
            with self._lock:
                return see()
        except GaitSegmentationError as error:
            self._blind = self._networks is None
            return Detections(stamp_ns, None, error=str(error))

    def _detections(
        self,
        image: NDArray[np.uint8],
        stamp_ns: int,
        due: bool,
        close: bool,
        unsure: Sequence[Box],
    ) -> Detections:
        networks, started = self._open(), self._clock()
        look, least = networks.people, networks.least_share
        if close and networks.closely is not None:
            look, least = networks.closely, 0.0
        seen = tuple(look(image)) if due and look is not None else None
        if seen is not None and networks.about is not None:
            for box in unsure[:_MOST_UNSURE]:
                seen = tuple(merged(seen, networks.about(image, box)))
        heat_map = networks.heat_map(image) if networks.heat_map is not None else None
        return Detections(stamp_ns, seen, heat_map, least, self._clock() - started)


def _give_way() -> None:
    """Let the threads that frames wait for go first, where that can be had (Linux)."""
    with suppress(OSError, AttributeError):
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _NICENESS)
