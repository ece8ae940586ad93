# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Films."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from typing import Any

import av
import numpy as np
from av.container import InputContainer
from av.error import FFmpegError
from av.video.frame import VideoFrame
from av.video.reformatter import VideoReformatter
from numpy.typing import NDArray

from gait_segmentation.encodings import check_pixels
from gait_segmentation.errors import InputError, SequenceError
from gait_segmentation.files import film_name
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

# Older versions of PyAV have Python log what FFmpeg says of every spoilt packet.
av.logging.set_level(av.logging.PANIC)

_MP4_BEGINS = (b'ftyp', b'wide', b'free', b'mdat')
_PACKED = ('.7z', '.bz2', '.gz', '.lz4', '.rar', '.tar', '.tgz', '.xz', '.zip', '.zst', '.zstd')
_ASSUMED_FPS, _MOST_FPS = 25, 1000
_LATEST_S = 2e9
"""Seconds: hardly more fit into the stamp of a message."""

_SHORTER, _SHORTER_S = 0.05, 0.5
"""Share and seconds by which a film may be shorter than it claims."""


class FilmSource(ImageSource):
    """A film file; ``fps`` is what it says, 30 if it says nothing sensible."""

    def open(self) -> int | None:
        """Open the film once."""
        with self._film() as film:
            stream = film.streams.video[0]
            fps = float(stream.average_rate or 0)
            self._fps = fps if 0 < fps <= _MOST_FPS else DEFAULT_FPS
            # Without its index an AVI has but a guess.
            if film.format.name == 'avi':
                self._promised_s = stream.frames / self._fps
            elif stream.duration and stream.time_base:
                self._promised_s = float(stream.duration * stream.time_base)
            else:
                self._promised_s = (film.duration or 0) / av.time_base
            claimed = stream.frames or round(self._promised_s * self._fps)
            timeless = film.duration is None and stream.start_time is None
            try:
                check_pixels((stream.width, stream.height), self._max_pixels, f'{self.path}: ')
            except InputError as error:
                raise SequenceError(str(error)) from error
        if timeless and self._fps == _ASSUMED_FPS and not self._rate:
            LOGGER.warning(
                '%s has no times and is read at 25 frames per second: --rate (rate:= of a launch '
                'file) says what is true',
                self.path,
            )
        # A hint: films are trimmed without being encoded again, and some formats only estimate.
        return claimed if 0 < claimed <= MOST_FRAMES else None

    def _film(self) -> InputContainer:
        try:
            film = av.open(film_name(self.path), metadata_errors='ignore')
        except FFmpegError as error:
            raise SequenceError(
                f'{self.path} cannot be read as a film: {self._why_closed()}'
            ) from error
        if not film.streams.video or film.streams.video[0].codec_context is None:
            raise SequenceError(f'{self.path} holds no film, or FFmpeg lacks its codec')
        return film

    def _why_closed(self) -> str:
        """Return what is wrong with what FFmpeg cannot open."""
        with self.path.open('rb') as file:
            if file.read(8)[4:] in _MP4_BEGINS:
                return (
                    'the recording was cut off before it was finished: its index (moov atom), '
                    'which is written last, is missing or damaged; record or copy it again'
                )
        if self.path.suffix.lower() in _PACKED:
            return 'it is packed: unpack it first'
        if self.path.suffix == '.active':
            return 'its recorder was killed: rosbag reindex FILE mends it, then name it .bag'
        return 'it is none'

    def rate(self) -> float:
        """Return what was asked for, or what the film says."""
        return self._rate or self._fps

    def entries(self) -> Iterator[Entry]:
        """Yield all frames; DamagedError at the end if some are missing."""
        fps = self.rate()
        number = last_ns = 0
        end_s = 0.0
        failed = False
        # One for all: a frame's own would be made anew each time.
        convert = VideoReformatter()
        with self._film() as film:
            # Not by seeking: that lands on another frame in films with few key frames.
            for frame in _decoded(film):
                if frame is None:
                    # Recordings of broadcasts may begin between two key frames.
                    failed = number > 0
                    continue
                time_s = number / self._fps if frame.time is None else min(frame.time, _LATEST_S)
                end_s = time_s + 1 / self._fps
                place = number if self._rate else time_s * fps
                last_ns = stamp_ns = max(film_stamp_ns(place, fps), last_ns + LEAST_STEP_NS)
                yield Entry(stamp_ns, stamp_ns, CAMERA, partial(_upright, frame, convert))
                number += 1
            codec = film.streams.video[0].codec_context.name
        if not number:
            raise SequenceError(
                f'{self.path}: no frame can be decoded; its codec is {codec!a}: encode it again, '
                'such as with ffmpeg -i FILE NEW.mp4'
            )
        # Durations are often those of the sound, and trimming is not exact.
        if failed or end_s < (1 - _SHORTER) * self._promised_s - _SHORTER_S:
            raise DamagedError(
                f'{self.path} is damaged: {number} of about '
                f'{round(self._promised_s * self._fps)} frames can be read; copy or record it '
                'again'
            )


def _decoded(film: InputContainer) -> Iterator[VideoFrame | None]:
    """Yield the frames, None where some cannot be decoded."""
    # Not in threads a frame each: those lose frames where a film is damaged, and some versions of
    # PyAV wait for ever for them at the end.
    try:
        for packet in film.demux(film.streams.video[0]):
            try:
                yield from packet.decode()
            except FFmpegError:
                yield None
    except FFmpegError:
        yield None


def _upright(frame: VideoFrame, convert: VideoReformatter) -> NDArray[np.uint8]:
    """Return the image of a frame, turned as films of telephones ask for."""
    image = np.asarray(convert.reformat(frame, format='bgr24').to_ndarray(), np.uint8)
    matrix: Any = frame.side_data.get('DISPLAYMATRIX')
    if matrix is not None:
        across, down = np.frombuffer(matrix, np.int32)[:2]
        image = np.rot90(image, -round(math.degrees(math.atan2(down, across)) / 90))
    return image
