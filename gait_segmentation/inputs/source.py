# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What all inputs have in common: frames by number, with stamps, scaled to a width."""

from __future__ import annotations

import logging
import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gait_segmentation import MOST_PIXELS
from gait_segmentation.errors import InputError, SequenceError
from gait_segmentation.images import shrink

Shape = tuple[int, int]

LOGGER = logging.getLogger('gait_segmentation')
CAMERA = 'camera'
"""InputFrame id of what has none."""

DEFAULT_FPS = 30.0
"""Of what does not say how fast it is."""

_RATES_HZ = (0.01, 1000.0)
MOST_FRAMES, _MOST_WIDTH, _MOST_ALLOWED_PIXELS = 2**31 - 1, 1 << 16, 1 << 30
"""Beyond what any input has, and within what all that counts them can hold."""


class DamagedError(SequenceError):
    """An input breaks off: all that came before has been handed out, the rest cannot be read."""


@dataclass(frozen=True)
class Entry:
    """
    A frame that has not been decoded.

    ``header_ns`` is the stamp of its header, ``recorded_ns`` the time of recording.  ``shape`` is
    what it claims to have, (0, 0) if it says nothing.  ``decode`` raises :class:`InputError` if
    this one frame cannot be read.
    """

    header_ns: int
    recorded_ns: int
    frame_id: str
    decode: Callable[[], NDArray[np.uint8]]
    shape: Shape = (0, 0)


@dataclass(frozen=True)
class InputFrame:
    """
    A frame of an input.

    ``number`` counts from 0 at the beginning of the input.  ``stamp_ns`` tells frames apart: the
    stamp of the header, or the time of recording where the header has none.  ``image`` is
    (H, W, 3) uint8 BGR, or None if it could not be read, and ``problem`` says why.  ``shape`` is
    that of the image, or what a frame that could not be read claims to have, (0, 0) if nothing.
    """

    number: int
    stamp_ns: int
    recorded_ns: int
    header_ns: int
    frame_id: str
    shape: Shape
    image: NDArray[np.uint8] | None
    problem: str = ''


def film_stamp_ns(number: float, fps: float) -> int:
    """Return the stamp of a frame of a film: its end, since zero stands for no stamp."""
    return round((number + 1) * 1e9 / fps)


def check_rate(rate: float) -> None:
    """Raise SequenceError if a rate is neither 0, the input's own, nor one that can be played."""
    # Written so that what is no number is refused.
    if rate != 0 and not _RATES_HZ[0] <= rate <= _RATES_HZ[1]:
        low, high = _RATES_HZ
        raise SequenceError(f'rate must be 0, or from {low:g} to {high:g} Hz, got {rate:g}')


class ImageSource(ABC):
    """
    An input that can be read from its beginning as often as one likes.

    ``size`` is the width and height of the first frame, ``scale`` the factor from its pixels in
    the input to those handed out.  ``fps`` is the rate of the frames, ``total`` how many there
    are from the start, None if that is not known.
    """

    def __init__(
        self,
        path: Path,
        *,
        width: int = 0,
        start: int = 0,
        count: int | None = None,
        rate: float = 0.0,
        rotate: int = 0,
        max_pixels: int = MOST_PIXELS,
        sample_bits: int = 16,
    ) -> None:
        """Read the first frame; for parameters and errors see :func:`open_input`."""
        self.path = path
        self.start = start
        self.count = count
        self._width = width
        self._rate = rate
        self._rotate = rotate
        self._max_pixels = max_pixels
        self._sample_bits = sample_bits
        check_rate(rate)
        for name, value, least, most in (
            ('start', start, 0, MOST_FRAMES),
            ('count', count, 1, MOST_FRAMES),
            ('width', width, 0, _MOST_WIDTH),
            ('max_pixels', max_pixels, 1, _MOST_ALLOWED_PIXELS),
            ('sample_bits', sample_bits, 8, 16),
        ):
            if value is not None and not least <= value <= most:
                raise SequenceError(f'{name} must be from {least} to {most}, got {value}')
        if rotate not in (0, 90, 180, 270):
            raise SequenceError(f'rotate must be 0, 90, 180 or 270, got {rotate}')
        if not path.exists():
            raise SequenceError(f'{path} does not exist')
        if not os.access(path, os.R_OK):
            raise SequenceError(f'{path} cannot be read: permission denied')
        number = self.open()
        self.total = None if number is None else max(number - start, 0)
        if count is not None:
            self.total = count if self.total is None else min(self.total, count)
        self.scale, self.size = self._look()
        self.fps = self.rate()

    @abstractmethod
    def open(self) -> int | None:
        """
        Find out what is there.

        :returns: the number of frames in the whole input, None if unknown.
        :raises SequenceError: if it cannot be used.
        """

    def rate(self) -> float:
        """Return the frames per second: what was asked for, or the default."""
        return self._rate or DEFAULT_FPS

    @abstractmethod
    def entries(self) -> Iterator[Entry]:
        """Yield all frames from the beginning of the input; DamagedError where it breaks off."""

    def frames(self) -> Iterator[InputFrame]:
        """
        Yield the frames wanted.

        :raises DamagedError: where the input breaks off, after all the frames before.
        :raises SequenceError: if the input cannot be read any more.
        """
        for number, entry in self._wanted():
            stamp_ns = entry.header_ns or entry.recorded_ns
            about = (number, stamp_ns, entry.recorded_ns, entry.header_ns, entry.frame_id)
            try:
                image = np.rot90(entry.decode(), -self._rotate // 90)
            except InputError as error:
                claimed = self._scaled_shape(self._turned(entry.shape))
                yield InputFrame(*about, claimed, None, str(error))
            else:
                shape = self._scaled_shape((image.shape[0], image.shape[1]))
                small = shrink(np.ascontiguousarray(image), shape)
                yield InputFrame(*about, shape, np.ascontiguousarray(small))

    def images(self) -> Iterator[NDArray[np.uint8]]:
        """Yield the images of the frames that can be read, (H, W, 3) uint8 BGR."""
        for frame in self.frames():
            if frame.image is not None:
                yield frame.image

    def _wanted(self) -> Iterator[tuple[int, Entry]]:
        stop = None if self.count is None else self.start + self.count
        return islice(enumerate(self.entries()), self.start, stop)

    def _look(self) -> tuple[float, tuple[int, int]]:
        """Return scale and size of the first frame that can be read."""
        problem = f'{self.path} has no frame {self.start}'
        try:
            for number, entry in self._wanted():
                try:
                    shape = self._turned(entry.decode().shape[:2])
                except InputError as error:
                    problem = f'{self.path}: no frame can be read; frame {number}: {error}'
                    continue
                return self._factor(shape[1]), self._scaled_shape(shape)[::-1]
        except DamagedError as error:
            problem = f'{problem}: {error}'
        raise SequenceError(problem)

    def _turned(self, shape: Shape) -> Shape:
        return shape[::-1] if self._rotate % 180 else shape

    def _factor(self, width: int) -> float:
        return min(self._width / width, 1.0) if self._width else 1.0

    def _scaled_shape(self, shape: Shape) -> Shape:
        if min(shape) == 0:
            return shape
        factor = self._factor(shape[1])
        return (max(round(shape[0] * factor), 1), max(round(shape[1] * factor), 1))
