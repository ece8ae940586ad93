# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Films and folders of images."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import InputError, SequenceError
from gait_segmentation.files.encoded_images import check_pixels, is_image
from gait_segmentation.files.image_files import IMAGE_SUFFIXES, images_in, read_image
from gait_segmentation.files.output_files import film_name
from gait_segmentation.inputs.encodings import SampleBits
from gait_segmentation.inputs.source import DEFAULT_FPS, MOST_FRAMES, Entry, ImageSource

_FRAME_ID = 'camera'
_OFF = 0.5
"""Periods by which a frame's own time may differ from the rate before it is believed instead."""


def _stamp_ns(number: int, fps: float) -> int:
    """Return the stamp of a frame of a film: its end, since zero stands for no stamp."""
    return round((number + 1) * 1e9 / fps)


class _Times:
    """
    Stamps of the frames of a film: of the rate, or of the film's own times where they differ.

    Films of telephones have uneven frames, and some containers claim the rate of half frames.
    """

    def __init__(self, fps: float) -> None:
        self._fps = fps
        self._first_ms: float | None = None
        self._last_ns = 0

    def stamp_ns(self, number: int, own_ms: float) -> int:
        """Return the stamp of the next frame; they always ascend."""
        if self._first_ms is None:
            self._first_ms = own_ms
        stamp_ns = _stamp_ns(number, self._fps)
        own_ns = round(1e6 * (own_ms - self._first_ms) + 1e9 / self._fps)
        if abs(own_ns - stamp_ns) > _OFF * 1e9 / self._fps and own_ns > self._last_ns:
            stamp_ns = own_ns
        self._last_ns = max(stamp_ns, self._last_ns + 1)
        return self._last_ns


class FilmSource(ImageSource):
    """A film file; ``fps`` is what it says, 30 if it says nothing sensible."""

    def open(self) -> int | None:
        """Open the film once."""
        with self.path.open('rb') as file:
            image = is_image(file.read(12))
        if image:
            # A film as well, but decoded without a limit as soon as it is opened as such.
            read_image(self.path, max_pixels=self._max_pixels)
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
            raise SequenceError(
                f'{self.path} cannot be read as a film: it is none, or OpenCV lacks its codec'
            )
        try:
            check_pixels((width, height), self._max_pixels)
        except InputError as error:
            raise SequenceError(f'{self.path}: {error}') from error
        # A hint: films are trimmed without being encoded anew, and some formats only estimate.
        return claimed if 0 < claimed <= MOST_FRAMES else None

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
        times = _Times(fps)
        own = not self._rate
        try:
            # Not by seeking: that lands on another frame in films with few key frames.
            while capture.grab():
                stamp_ns = _stamp_ns(number, fps)
                if own:
                    stamp_ns = times.stamp_ns(number, capture.get(cv2.CAP_PROP_POS_MSEC))
                yield Entry(stamp_ns, stamp_ns, _FRAME_ID, partial(_retrieve, capture))
                number += 1
            if not number:
                raise SequenceError(
                    f'{self.path}: no frame can be decoded; its codec is {self._codec!a}: encode '
                    'it anew, such as with ffmpeg -i FILE NEW.mp4'
                )
        finally:
            capture.release()


class FolderSource(ImageSource):
    """A folder of images in the order of the numbers in their names, 30 a second if not asked."""

    def open(self) -> int:
        """List the images."""
        self._files = images_in(self.path)
        if not self._files:
            raise SequenceError(
                f'{self.path} holds no images ({", ".join(IMAGE_SUFFIXES)}) and no bag'
            )
        return len(self._files)

    def rate(self) -> float:
        """Return what was asked for, or the default: a folder says nothing."""
        return self._rate or DEFAULT_FPS

    def entries(self) -> Iterator[Entry]:
        """Yield all frames."""
        bits = SampleBits()
        for number, path in enumerate(self._files):
            stamp_ns = _stamp_ns(number, self.rate())
            decode = partial(_read, path, self._max_pixels, bits)
            yield Entry(stamp_ns, stamp_ns, _FRAME_ID, decode)


def _read(path: Path, max_pixels: int, bits: SampleBits) -> NDArray[np.uint8]:
    """
    Read an image of a folder.

    :raises InputError: if it cannot be read, which is the matter of this one frame.
    """
    try:
        image = read_image(path, cv2.IMREAD_COLOR | cv2.IMREAD_ANYDEPTH, max_pixels)
    except SequenceError as error:
        raise InputError(str(error)) from error
    return bits.of(image, str(path))


def _retrieve(capture: cv2.VideoCapture) -> NDArray[np.uint8]:
    read, image = capture.retrieve()
    if not read:
        raise SequenceError('a frame of the film cannot be decoded')
    return np.asarray(image)
