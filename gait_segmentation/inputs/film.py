# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Films and folders of images."""

from __future__ import annotations

import mmap
import re
from collections.abc import Iterator
from functools import partial

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import InputError, SequenceError
from gait_segmentation.files import film_name
from gait_segmentation.inputs.encodings import check_pixels
from gait_segmentation.inputs.source import (
    CAMERA,
    DEFAULT_FPS,
    LOGGER,
    MOST_FRAMES,
    DamagedError,
    Entry,
    ImageSource,
    film_stamp_ns,
)
from gait_segmentation.stamps import LEAST_STEP_NS

_MP4_BEGINS = (b'ftyp', b'wide', b'free', b'mdat')
_MP4_HEAD = re.compile(rb'mvhd(?:\x00.{11}|\x01.{19})(.{4})', re.DOTALL)
_MP4_EDITS = re.compile(rb'elst([\x00\x01])...(.{4})', re.DOTALL)
_OFF = 0.5
"""Periods by which a frame's own time may differ from the rate before it is used instead."""

_TIMELESS, _ASSUMED_FPS = (b'\xff\xd8\xff', b'\0\0\0\1'), 25.0
"""What raw streams of MJPEG, H.264 and H.265 begin with, and their rate if they tell none."""

_PACKED = ('.7z', '.bz2', '.gz', '.lz4', '.rar', '.tar', '.tgz', '.xz', '.zip', '.zst', '.zstd')
_MOST_FPS = 1000
_SHORTER, _SHORTER_S = 0.05, 0.5
"""Share and seconds by which a film may be shorter than it claims."""


class FilmSource(ImageSource):
    """A film file; ``fps`` is what it says, 30 if it says nothing sensible."""

    def open(self) -> int | None:
        """Open the film once."""
        capture = self._capture()
        opened = capture.isOpened()
        self._fps = float(capture.get(cv2.CAP_PROP_FPS))
        self._claimed = claimed = int(capture.get(cv2.CAP_PROP_FRAME_COUNT))
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
            check_pixels((width, height), self._max_pixels, f'{self.path}: ')
        except InputError as error:
            raise SequenceError(str(error)) from error
        with self.path.open('rb') as file:
            timeless = file.read(4).startswith(_TIMELESS)
        if timeless and self._fps == _ASSUMED_FPS and not self._rate:
            LOGGER.warning(
                '%s has no times and is read at 25 frames per second: --rate (rate:= of a launch '
                'file) says what is true',
                self.path,
            )
        # A hint: films are trimmed without being encoded again, and some formats only estimate.
        return claimed if 0 < claimed <= MOST_FRAMES else None

    def _why_closed(self) -> str:
        """Return what is wrong with what OpenCV cannot open."""
        if self._index() == b'':
            return (
                'the recording was cut off before it was finished: its index (moov atom), which '
                'is written last, is missing; record or copy it again'
            )
        if self.path.suffix.lower() in _PACKED:
            return 'it is packed: unpack it first'
        if self.path.suffix == '.active':
            return 'its recorder was killed: rosbag reindex FILE mends it, then name it .bag'
        return 'it is none, or OpenCV lacks its codec'

    def _index(self) -> bytes | None:
        """Return the index of an MP4, empty if it is missing; None of other films."""
        with self.path.open('rb') as file:
            if file.read(8)[4:] not in _MP4_BEGINS:
                return None
            with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
                at = data.find(b'moov')
                return data[at : at + int.from_bytes(data[at - 4 : at], 'big')] if at > 3 else b''

    def _promised_s(self) -> float:
        """Return how long a film claims to be, without what an edit list of MP4 hides."""
        index = self._index() or b''
        promised_s = self._claimed / self._fps
        head = _MP4_HEAD.search(index)
        for edits in _MP4_EDITS.finditer(index) if head else ():
            step, size = (20, 8) if edits[1] == b'\1' else (12, 4)
            begins = range(edits.end(), len(index), step)[: int.from_bytes(edits[2], 'big')]
            shown = sum(int.from_bytes(index[each : each + size], 'big') for each in begins)
            if shown and head:
                promised_s = min(promised_s, shown / max(int.from_bytes(head[1], 'big'), 1))
        return promised_s

    def _check_end(self, number: int, first: float, last_ms: float) -> None:
        """Refuse a film that claims to be longer; times are of its first and last frame."""
        if not (0 < self._fps <= _MOST_FPS and number < self._claimed <= MOST_FRAMES):
            return
        promised_s = self._promised_s()
        # Durations are often those of the sound, and trimming is not exact.
        if (first + 1) / self._fps + last_ms / 1e3 < (1 - _SHORTER) * promised_s - _SHORTER_S:
            raise DamagedError(
                f'{self.path} is damaged: {number} of about {round(promised_s * self._fps)} '
                'frames can be read; copy or record it again'
            )

    def _capture(self) -> cv2.VideoCapture:
        capture = cv2.VideoCapture(film_name(self.path))
        # OpenCV 4.11 does not turn films of telephones, and 4.6 turns them the other way.
        capture.set(cv2.CAP_PROP_ORIENTATION_AUTO, 0)
        return capture

    def rate(self) -> float:
        """Return what was asked for, or what the film says."""
        return self._rate or (self._fps if 0 < self._fps <= _MOST_FPS else DEFAULT_FPS)

    def entries(self) -> Iterator[Entry]:
        """Yield all frames; DamagedError where it ends early."""
        capture = self._capture()
        fps = self.rate()
        number = 0
        first_ns = last_ns = 0
        first = last_ms = 0.0
        try:
            # Not by seeking: that lands on another frame in films with few key frames.
            while capture.grab():
                stamp_ns = film_stamp_ns(number, fps)
                # Films of telephones have uneven frames, and some containers claim the rate of
                # half frames.
                last_ms = capture.get(cv2.CAP_PROP_POS_MSEC)
                own_ns = round(1e6 * last_ms) + film_stamp_ns(0, fps)
                if not number and hasattr(cv2, 'CAP_PROP_PTS'):
                    # OpenCV counts its times from the first frame, which may have a clock's.
                    first = max(capture.get(cv2.CAP_PROP_PTS), 0.0)
                    first_ns = round(1e9 * first / fps)
                differs = abs(own_ns - stamp_ns) > _OFF * 1e9 / fps
                if not self._rate:
                    plausible = differs and first_ns + own_ns > last_ns
                    stamp_ns = first_ns + (own_ns if plausible else stamp_ns)
                last_ns = stamp_ns = max(stamp_ns, last_ns + LEAST_STEP_NS)
                yield Entry(stamp_ns, stamp_ns, CAMERA, partial(_retrieve, capture))
                number += 1
            if not number:
                raise SequenceError(
                    f'{self.path}: no frame can be decoded; its codec is {self._codec!a}: encode '
                    'it again, such as with ffmpeg -i FILE NEW.mp4'
                )
            self._check_end(number, first, last_ms)
        finally:
            capture.release()


def _retrieve(capture: cv2.VideoCapture) -> NDArray[np.uint8]:
    read, image = capture.retrieve()
    if not read:
        raise SequenceError('a frame of the film cannot be decoded')
    return np.asarray(image)
