# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Heat maps recorded beside an input: in a folder, or on a topic of the same bag."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from gait_segmentation import MOST_PIXELS
from gait_segmentation.errors import SequenceError
from gait_segmentation.inputs import encodings
from gait_segmentation.inputs.bag import BagSource, is_bag
from gait_segmentation.inputs.folder import images_in, load_heat_map
from gait_segmentation.inputs.source import Entry, Frame

RecordedMap: TypeAlias = tuple[int, Callable[[], NDArray[np.uint8]]]
"""The stamp of a map, and what decodes it or raises :class:`GaitSegmentationError`."""

RecordedMaps: TypeAlias = Callable[[Frame], Iterator[RecordedMap]]
"""Yields the maps that belong to a frame or came since the one before."""

_NUMBER = re.compile(r'[0-9]+$')


class HeatMapBag(BagSource):
    """The heat maps on a topic of a bag."""

    @staticmethod
    def read(message: Any, most: int = MOST_PIXELS, bits: int = 16) -> NDArray[np.uint8]:
        """Decode a message that is raw or compressed."""
        if hasattr(message, 'encoding'):
            return encodings.read_heat_map(message, most)
        return encodings.read_compressed(message, most, bits)


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
    entries = HeatMapBag(path, topic=place, max_pixels=max_pixels).entries()
    waiting: list[Entry] = []
    return lambda frame: _until(entries, waiting, frame)


def _of_frame(files: dict[int, Path], frame: Frame, max_pixels: int) -> Iterator[RecordedMap]:
    path = files.get(frame.number, files.get(frame.stamp_ns))
    if path is not None:
        yield frame.stamp_ns, lambda: load_heat_map(path, max_pixels)


def _until(entries: Iterator[Entry], waiting: list[Entry], frame: Frame) -> Iterator[RecordedMap]:
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
