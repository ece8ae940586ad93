# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Every frame of an input through a pipeline, in lockstep, with heat maps recorded beside it."""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from gait_segmentation import MOST_PIXELS
from gait_segmentation.encodings import read_compressed, read_heat_map
from gait_segmentation.errors import GaitSegmentationError, InputError, SequenceError
from gait_segmentation.geometry import Box
from gait_segmentation.inputs import DamagedError, ImageSource, InputFrame
from gait_segmentation.inputs.bag import BagSource, is_bag
from gait_segmentation.inputs.folder import images_in, load_heat_map
from gait_segmentation.inputs.source import Entry
from gait_segmentation.pipeline import FrameResult, Pipeline
from gait_segmentation.results import TrackResult
from gait_segmentation.stamps import HeldFrames, Order, Stamps
from gait_segmentation.streams.intake import Intake

Item = TypeVar('Item')

RecordedMap: TypeAlias = tuple[int, Callable[[], NDArray[np.uint8]]]
"""The stamp of a map, and what decodes it or raises :class:`GaitSegmentationError`."""

RecordedMaps: TypeAlias = Callable[[InputFrame], Iterator[RecordedMap]]
"""Yields the maps that belong to a frame or came since the one before."""

_NUMBER = re.compile(r'[0-9]+$')


class Replayed(NamedTuple):
    """A frame of the input and what was found in it."""

    frame: InputFrame
    result: FrameResult


def ahead(items: Iterator[Item], depth: int = 4) -> Generator[Item, None, None]:
    """
    Yield the items of an iterator that runs in a thread, so that other work goes on meanwhile.

    The order stays the same, and an error of the iterator is raised where it occurred.

    :param depth: items that may wait.
    """
    end = object()
    waiting: deque[Future[Item | object]] = deque()
    with ThreadPoolExecutor(1, thread_name_prefix='ahead') as thread:
        try:
            while True:
                while len(waiting) <= depth:
                    waiting.append(thread.submit(next, items, end))
                item = waiting.popleft().result()
                if item is end:
                    return
                yield item  # type: ignore[misc]
        finally:
            for each in waiting:
                each.cancel()
            # A generator that is not exhausted has things to close.
            if isinstance(items, Generator):
                thread.submit(items.close)


def results_of(
    source: ImageSource,
    pipeline: Pipeline,
    box: Box | None,
    warn: Callable[[str], None],
    heat_maps: RecordedMaps | None = None,
) -> Iterator[Replayed]:
    """
    Run every frame through a pipeline.

    A frame that cannot be read or used has an empty result, as from the nodes;
    one whose stamp is not later than that before has none.

    :param box: of the person in the first frame, in pixels of the frames.
    :param warn: is called with each warning.
    :param heat_maps: those of the input, if there are any.
    :raises DamagedError: where the input breaks off, after all results of the frames before.
    """
    run = _Lockstep(pipeline, box, warn, heat_maps)
    damage: DamagedError | None = None
    try:
        for frame in ahead(source.frames()):
            yield from run.take(frame)
    except DamagedError as error:
        damage = error
    yield from run.end()
    if damage is not None:
        raise damage


class _Lockstep:
    """A pipeline that takes one frame of an input after the other; see :func:`results_of`."""

    def __init__(
        self,
        pipeline: Pipeline,
        box: Box | None,
        warn: Callable[[str], None],
        heat_maps: RecordedMaps | None,
    ) -> None:
        self._pipeline, self._warn, self._heat_maps = pipeline, warn, heat_maps
        self._held: HeldFrames[InputFrame] = HeldFrames()
        self._likelihood_shape = (0, 0)
        self._flushed: list[Replayed] = []
        self._stamps = Stamps()
        self._intake = Intake(
            reset=self._drop_tracks,
            initialize=pipeline.initialize,
            warn=lambda _, text: warn(text),
            initial_box=box,
        )

    def take(self, frame: InputFrame) -> Iterator[Replayed]:
        """Yield what a frame of the input completes."""
        results: list[FrameResult] = []
        answered_by, warn = None, self._warn
        if frame.image is None:
            warn(f'frame {frame.number} cannot be read: {frame.problem}')
        elif frame.stamp_ns <= 0:
            warn(f'frame {frame.number} cannot be used: its stamp is {frame.stamp_ns} ns')
        elif (order := self._stamps.take(frame.stamp_ns)) is Order.STALE:
            warn(f'frame {frame.number} is dropped: its stamp is not later than the one before')
            return
        else:
            if order is Order.RESET:
                warn(f'the stamp went back at frame {frame.number}: everything is reset')
                self._drop_tracks()
                self._intake.armed = True
            self._intake.take(frame.image, frame.stamp_ns)
            yield from self._take_flushed()
            if self._heat_maps is not None:
                _add_heat_maps(self._pipeline, self._heat_maps(frame), frame, warn)
            try:
                results = self._pipeline.update(frame.image, frame.stamp_ns)
                answered_by = frame.stamp_ns
            except InputError as error:
                warn(f'frame {frame.number} cannot be used: {error}')
        self._held.hold(answered_by, frame)
        yield from self._answers(results)

    def end(self) -> Iterator[Replayed]:
        """Yield what is left when there are no more frames."""
        self._drop_tracks()
        yield from self._take_flushed()

    def _answers(
        self, results: Iterable[FrameResult], *, last: bool = False
    ) -> Iterator[Replayed]:
        """Yield results with their frames in order, and blank ones of frames without."""
        slots = self._pipeline.config.people.max_people
        for frame, result in self._held.answered(results, last=last):
            if result is not None:
                likelihood = result.people[0].track.likelihood
                self._likelihood_shape = (likelihood.shape[0], likelihood.shape[1])
            yield Replayed(frame, result or _blank(frame, slots, self._likelihood_shape))

    def _drop_tracks(self) -> None:
        self._flushed.extend(self._answers(self._pipeline.flush(), last=True))
        self._pipeline.reset()

    def _take_flushed(self) -> list[Replayed]:
        flushed, self._flushed = self._flushed, []
        return flushed


def open_heat_maps(place: str, path: Path, max_pixels: int = MOST_PIXELS) -> RecordedMaps:
    """
    Open the heat maps of an input.

    :param place: a folder of images whose names end in the number of their frame, counted from 0,
        or in its stamp in nanoseconds; or a topic of the input, if that is a bag.
    :param path: the input.
    :param max_pixels: how many a map may have.
    :raises SequenceError: if there are no maps.
    """
    folder = Path(place)
    if folder.is_dir():
        numbers = ((_NUMBER.search(each.stem), each) for each in images_in(folder))
        files = {int(found[0]): each for found, each in numbers if found}
        if not files:
            raise SequenceError(
                f'--heat-map {place}: there are no images named by number or stamp, like 0000.png'
            )
        return lambda frame: _of_frame(files, frame, max_pixels)
    if not (path.exists() and is_bag(path)):
        raise SequenceError(f'--heat-map {place}: there is no such folder, and {path} is no bag')
    entries = BagSource(path, topic=place, read=_read_map, max_pixels=max_pixels).entries()
    waiting: list[Entry] = []
    return lambda frame: _until(entries, waiting, frame)


def _of_frame(files: dict[int, Path], frame: InputFrame, max_pixels: int) -> Iterator[RecordedMap]:
    path = files.get(frame.number, files.get(frame.stamp_ns))
    if path is not None:
        yield frame.stamp_ns, lambda: load_heat_map(path, max_pixels)


def _read_map(message: Any, most: int, bits: int) -> NDArray[np.uint8]:
    if hasattr(message, 'encoding'):
        return read_heat_map(message, most)
    return read_compressed(message, most, bits)


def _until(
    entries: Iterator[Entry], waiting: list[Entry], frame: InputFrame
) -> Iterator[RecordedMap]:
    """Yield the maps up to the stamp of a frame; the first one beyond it waits."""
    while True:
        entry = waiting.pop() if waiting else next(entries, None)
        if entry is None:
            return
        stamp_ns = entry.header_ns or entry.recorded_ns
        if stamp_ns > frame.stamp_ns:
            waiting.append(entry)
            return
        yield stamp_ns, entry.decode


def _add_heat_maps(
    pipeline: Pipeline,
    heat_maps: Iterator[RecordedMap],
    frame: InputFrame,
    warn: Callable[[str], None],
) -> None:
    """Give the heat maps up to a frame to a pipeline."""
    try:
        for stamp_ns, read in heat_maps:
            try:
                pipeline.add_heat_map(read(), stamp_ns)
            except GaitSegmentationError as error:
                warn(f'the heat map of frame {frame.number} is left out: {error}')
    except DamagedError as error:
        warn(f'there are no more heat maps: {error}')


def _blank(frame: InputFrame, slots: int, likelihood_shape: tuple[int, int]) -> FrameResult:
    """Return the empty result of a frame."""
    track = TrackResult(frame.stamp_ns, 0, None, np.zeros(likelihood_shape, np.uint8), 0.0)
    return FrameResult.empty(track, frame.shape, slots, frame.problem)
