# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames of a film or of a folder of images, scaled to a width."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import SequenceError
from gait_segmentation.images import shrink

__all__ = ['Film']

_IMAGES = ('.bmp', '.jpeg', '.jpg', '.png', '.ppm', '.tif', '.tiff', '.webp')
_DEFAULT_FPS = 30.0


class Film:
    """
    A film file, or a folder of images in the order of their names.

    ``fps`` is what the film says, 30 for a folder.  ``scale`` is the factor from the film's
    pixels to those of the frames.
    """

    def __init__(
        self, path: Path, *, width: int = 0, start: int = 0, count: int | None = None
    ) -> None:
        """
        Open a film and look at its first frame.

        :param width: of the frames in pixels; 0, or more than the film has, leaves them as
            they are.
        :param start: first frame wanted, counted from 0.
        :param count: number of frames wanted, None for all that follow.
        :raises SequenceError: if the input is missing, holds no images, or has no such frames.
        """
        self.path = path
        self.start = start
        self.count = count
        self._width = width
        self._files: list[Path] = []
        if start < 0 or (count is not None and count < 1) or width < 0:
            raise SequenceError(
                f'start must be at least 0, count at least 1 and width at least 0, got {start}, '
                f'{count} and {width}'
            )
        if not path.exists():
            raise SequenceError(f'{path} does not exist')
        if path.is_dir():
            self._files = sorted(p for p in path.iterdir() if p.suffix.lower() in _IMAGES)
            if not self._files:
                raise SequenceError(f'{path} holds no images ({", ".join(_IMAGES)})')
        first = next(self._originals(), None)
        if first is None:
            raise SequenceError(f'{path} has no frame {start}')
        height, original = first.shape[:2]
        self.scale = min(width / original, 1.0) if width else 1.0
        self.size = (round(original * self.scale), round(height * self.scale))
        self.fps = self._rate()

    def frames(self) -> Iterator[NDArray[np.uint8]]:
        """
        Yield the frames from the start, (H, W, 3) uint8 BGR.

        :raises SequenceError: if an image cannot be read.
        """
        for image in self._originals():
            yield np.ascontiguousarray(shrink(image, self.size[::-1]))

    def _rate(self) -> float:
        if self._files:
            return _DEFAULT_FPS
        capture = cv2.VideoCapture(str(self.path))
        fps = float(capture.get(cv2.CAP_PROP_FPS))
        capture.release()
        return fps if 0 < fps <= 1000 else _DEFAULT_FPS

    def _originals(self) -> Iterator[NDArray[np.uint8]]:
        frames = self._read_folder() if self._files else self._read_film()
        for number, frame in enumerate(frames):
            if self.count is not None and number >= self.count:
                break
            yield frame

    def _read_folder(self) -> Iterator[NDArray[np.uint8]]:
        for path in self._files[self.start :]:
            image = cv2.imread(str(path), cv2.IMREAD_COLOR)
            if image is None:
                raise SequenceError(f'{path} cannot be read as an image')
            yield np.asarray(image)

    def _read_film(self) -> Iterator[NDArray[np.uint8]]:
        capture = cv2.VideoCapture(str(self.path))
        try:
            if not capture.isOpened():
                raise SequenceError(f'{self.path} cannot be read as a film')
            # Not by seeking: that lands on another frame in films with few key frames.
            for _ in range(self.start):
                if not capture.grab():
                    return
            while True:
                read, image = capture.read()
                if not read:
                    return
                yield np.asarray(image)
        finally:
            capture.release()
