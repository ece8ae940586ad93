# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Films and folders of images."""

from __future__ import annotations

import logging
import mmap
from collections import Counter
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import InputError, SequenceError
from gait_segmentation.files.image_files import (
    IMAGE_SUFFIXES,
    check_pixels,
    images_in,
    read_image,
)
from gait_segmentation.files.output_files import film_name
from gait_segmentation.inputs.encodings import in_8_bits
from gait_segmentation.inputs.source import DEFAULT_FPS, MOST_FRAMES, Entry, ImageSource
from gait_segmentation.stamps import LEAST_STEP_NS

_LOGGER = logging.getLogger('gait_segmentation')
_FRAME_ID = 'camera'
_MP4_BEGINS = (b'ftyp', b'wide', b'free', b'mdat')
_OFF = 0.5
"""Periods by which a frame's own time may differ from the rate before it is used instead."""


def _stamp_ns(number: int, fps: float) -> int:
    """Return the stamp of a frame of a film: its end, since zero stands for no stamp."""
    return round((number + 1) * 1e9 / fps)


class FilmSource(ImageSource):
    """A film file; ``fps`` is what it says, 30 if it says nothing sensible."""

    def open(self) -> int | None:
        """Open the film once."""
        capture = self._capture()
        opened = capture.isOpened()
        self._fps = float(capture.get(cv2.CAP_PROP_FPS))
        claimed = int(capture.get(cv2.CAP_PROP_FRAME_COUNT))
        codec = int(capture.get(cv2.CAP_PROP_FOURCC)) & 0xFFFFFFFF
        self._codec = codec.to_bytes(4, 'little').decode('latin-1')
        turned = int(capture.get(cv2.CAP_PROP_ORIENTATION_META))
        # OpenCV 4.6 has the other sign.
        self._rotate += -turned if cv2.__version__.startswith('4.6.') else turned
        sides = (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT)
        width, height = (int(capture.get(side)) for side in sides)
        capture.release()
        if not opened:
            raise SequenceError(f'{self.path} cannot be read as a film: {self._why_closed()}')
        try:
            check_pixels((width, height), self._max_pixels)
        except InputError as error:
            raise SequenceError(f'{self.path}: {error}') from error
        # A hint: films are trimmed without being encoded again, and some formats only estimate.
        return claimed if 0 < claimed <= MOST_FRAMES else None

    def _why_closed(self) -> str:
        """Return what is wrong with what OpenCV cannot open."""
        with self.path.open('rb') as file:
            if file.read(8)[4:] in _MP4_BEGINS:
                with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
                    if data.find(b'moov') < 0:
                        return (
                            'the recording was cut off before it was finished: its index (moov '
                            'atom), which is written last, is missing; record or copy it again'
                        )
        return 'it is none, or OpenCV lacks its codec'

    def _capture(self) -> cv2.VideoCapture:
        capture = cv2.VideoCapture(film_name(self.path))
        # OpenCV 4.11 does not turn films of telephones, and 4.6 turns them the other way.
        capture.set(cv2.CAP_PROP_ORIENTATION_AUTO, 0)
        return capture

    def rate(self) -> float:
        """Return what was asked for, or what the film says."""
        if self._rate:
            return self._rate
        return self._fps if 0 < self._fps <= 1000 else DEFAULT_FPS

    def entries(self) -> Iterator[Entry]:
        """Yield all frames."""
        capture = self._capture()
        fps = self.rate()
        number = 0
        first_ns = last_ns = 0
        try:
            # Not by seeking: that lands on another frame in films with few key frames.
            while capture.grab():
                stamp_ns = _stamp_ns(number, fps)
                # Films of telephones have uneven frames, and some containers claim the rate of
                # half frames.
                own_ns = round(1e6 * capture.get(cv2.CAP_PROP_POS_MSEC)) + _stamp_ns(0, fps)
                if not number and hasattr(cv2, 'CAP_PROP_PTS'):
                    # OpenCV counts its times from the first frame, which may have a clock's.
                    first_ns = max(0, round(1e9 * capture.get(cv2.CAP_PROP_PTS) / fps))
                differs = abs(own_ns - stamp_ns) > _OFF * 1e9 / fps
                if not self._rate:
                    plausible = differs and first_ns + own_ns > last_ns
                    stamp_ns = first_ns + (own_ns if plausible else stamp_ns)
                last_ns = stamp_ns = max(stamp_ns, last_ns + LEAST_STEP_NS)
                yield Entry(stamp_ns, stamp_ns, _FRAME_ID, partial(_retrieve, capture))
                number += 1
            if not number:
                raise SequenceError(
                    f'{self.path}: no frame can be decoded; its codec is {self._codec!a}: encode '
                    'it again, such as with ffmpeg -i FILE NEW.mp4'
                )
        finally:
            capture.release()


class FolderSource(ImageSource):
    """An image, or a folder of them in the order of the numbers in their names; 30 a second."""

    def open(self) -> int:
        """List the images."""
        self._files = images_in(self.path) if self.path.is_dir() else [self.path]
        if not self._files:
            raise SequenceError(
                f'{self.path} holds no images ({", ".join(IMAGE_SUFFIXES)}) and no bag'
            )
        others = Counter(each.suffix or each.name for each in self._others())
        if others:
            listed = ', '.join(f'{count} {suffix}' for suffix, count in others.items())
            _LOGGER.warning('%s: skipped what is no image that is read: %s', self.path, listed)
        return len(self._files)

    def _others(self) -> Iterator[Path]:
        for each in self.path.iterdir() if self.path.is_dir() else ():
            if each.suffix.lower() not in IMAGE_SUFFIXES and each.is_file():
                yield each

    def rate(self) -> float:
        """Return what was asked for, or the default: a folder says nothing."""
        return self._rate or DEFAULT_FPS

    def entries(self) -> Iterator[Entry]:
        """Yield all frames."""
        for number, path in enumerate(self._files):
            stamp_ns = _stamp_ns(number, self.rate())
            decode = partial(_read, path, self._max_pixels, self._sample_bits)
            yield Entry(stamp_ns, stamp_ns, _FRAME_ID, decode)


def _read(path: Path, max_pixels: int, bits: int) -> NDArray[np.uint8]:
    """
    Read an image of a folder.

    :raises InputError: if it cannot be read, which is the matter of this one frame.
    """
    try:
        image = read_image(path, cv2.IMREAD_COLOR | cv2.IMREAD_ANYDEPTH, max_pixels)
    except SequenceError as error:
        raise InputError(str(error)) from error
    return in_8_bits(image, str(path), bits)


def _retrieve(capture: cv2.VideoCapture) -> NDArray[np.uint8]:
    read, image = capture.retrieve()
    if not read:
        raise SequenceError('a frame of the film cannot be decoded')
    return np.asarray(image)
