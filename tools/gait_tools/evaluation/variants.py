# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Sequences with truth made harder, as worse cameras see them or with bad heat maps beside."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.people import MOST_PEOPLE
from gait_tools.evaluation.metrics import FrameScore
from gait_tools.evaluation.sequence import Sequence

# Blur of the heat maps and side of their blocks, pixels; share of blocks that are inverted.
SOFT, BLOCK, INVERTED = 4.0, 8, 0.1
# Frames of a film whose people can leave; seconds that follow, and until nobody may be seen.
LEFT_LEAST, LEFT_SECONDS, LEAVE_SECONDS = 30, 2.5, 0.5
# Frames that show the place, pixels about people that do not; noise of the camera, grey levels.
PLACE_FRAMES, LEFT_NEAR_PX, LEFT_NOISE = 60, 15, 1.5
Image = NDArray[np.uint8]


def _shifted(heat: Image, pixels: int) -> Image:
    return np.pad(heat, ((0, 0), (pixels, 0)))[:, : heat.shape[1]]


def _rng(number: int) -> np.random.Generator:
    return np.random.default_rng([number, 7])


def _jpeg(image: Image, quality: int) -> Any:
    data = cv2.imencode('.jpg', image, [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
    return cv2.imdecode(data, cv2.IMREAD_COLOR)


def _grey(image: Image, number: int) -> Any:
    return cv2.cvtColor(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR)


def _banded(image: Image, number: int) -> Any:
    """Let lamps flicker: bands that wander down the image."""
    rows = np.arange(len(image))[:, None, None] / len(image)
    return image * (1 + 0.15 * np.sin(2 * np.pi * (2 * rows - 0.37 * number)))


CAMERAS: dict[str, Callable[[Image, int], Any]] = {
    'plain': lambda image, number: image,
    'dark': lambda image, number: 0.3 * image,
    'low': lambda image, number: 0.35 * image + 90,
    'gamma': lambda image, number: 255 * (image / 255) ** 0.7,
    'gain': lambda image, number: image * (1 + 0.25 * math.sin(number / 6)),
    'flicker': _banded,
    'ramp': lambda image, number: (1 - 0.25 * min(number / 12, 1)) * image,
    'night': _grey,
    'warm': lambda image, number: image * np.array([0.88, 1.0, 1.12]),
    'grey': _grey,
    'jpeg': lambda image, number: _jpeg(image, 15),
    'noise': lambda image, number: image + _rng(number).normal(0.0, 12.0, image.shape),
    'blur': lambda image, number: cv2.GaussianBlur(image, (0, 0), 1.5),
}
"""What becomes of a frame, given its number (of :data:`LATE` since then), by the kind's name."""
LATE = ('flicker', 'ramp', 'night')  # these begin in the middle of the clip

MAPS: dict[str, Callable[[Image, int], Any]] = {
    'map': lambda heat, number: heat,
    'map-late': lambda heat, number: heat,
    'map-rare': lambda heat, number: heat,
    'map-mirrored': lambda heat, number: heat[:, ::-1],
    'map-shifted': lambda heat, number: _shifted(heat, heat.shape[1] // 8),
    'map-inverted': lambda heat, number: 255 - heat,
    'map-constant': lambda heat, number: np.full_like(heat, 200),
    'map-noise': lambda heat, number: _rng(number).integers(0, 256, heat.shape, np.uint8),
}
"""What becomes of a heat map that comes with the frame."""

TIMES = {'map-late': 'map:3', 'map-rare': 'map:0:3'}
"""How ``--heat-map`` says when they come, if not with their frames."""

KINDS = (*CAMERAS, *MAPS)


@dataclass(frozen=True)
class Variant(Sequence):
    """
    A sequence as a camera of a kind films it, or with heat maps of a kind.

    ``maps`` is the folder of those that the kind changes; without it they are made of the truth.
    """

    kind: str
    maps: str = ''

    @classmethod
    def of(cls, sequence: Sequence, kind: str, maps: str = '') -> Variant:
        """Make a variant of a sequence."""
        known = {each.name: getattr(sequence, each.name) for each in fields(Sequence)}
        return cls(**known, kind=kind, maps=maps)

    def image(self, number: int) -> Image:
        """Return what becomes of a frame, see :meth:`Sequence.image`."""
        image = super().image(number)
        if self.kind in LATE:
            number -= sorted(self.frames)[len(self.frames) // 2] - 1
            if number <= 0:
                return image
        change = CAMERAS.get(self.kind, CAMERAS['plain'])
        return np.clip(np.round(change(image, number)), 0, 255).astype(np.uint8)

    def heat_map(self, name: str, number: int) -> Image | None:
        """Return what becomes of a map, whatever the name."""
        if self.maps:
            heat = super().heat_map(self.maps, number)
        else:
            labels = self.labels(number)
            heat = None if labels is None else _heat(labels, number)
        return None if heat is None else np.ascontiguousarray(MAPS[self.kind](heat, number))


@dataclass(frozen=True)
class Left(Sequence):
    """
    A sequence of a camera that stands, whose people are gone ``since`` a frame of its middle.

    What is then seen of the place for :data:`LEFT_SECONDS` is the median of where nobody was.
    """

    since: int
    whole: Sequence

    @classmethod
    def of(cls, sequence: Sequence) -> Left | None:
        """Make one of a sequence, None if it is too short, or the camera not known to stand."""
        numbers = sequence.numbers
        if sequence.about.get('camera') != 'static' or len(numbers) < LEFT_LEAST:
            return None
        known = {each.name: getattr(sequence, each.name) for each in fields(Sequence)}
        since = numbers[len(numbers) // 2]
        later = range(since, since + round(LEFT_SECONDS * sequence.fps))
        before = {n: path for n, path in sequence.frames.items() if n < since}
        for name in ('masks', 'label_files'):
            known[name] = {n: path for n, path in known[name].items() if n < since}
        known['frames'] = before | dict.fromkeys(later, sequence.frames[since])
        return cls(**known, since=since, whole=sequence)

    def gone(self, scores: list[FrameScore]) -> list[FrameScore]:
        """Return the scores of the frames in which nobody ought to be seen any more."""
        return scores[-round((LEFT_SECONDS - LEAVE_SECONDS) * self.fps) :]

    def image(self, number: int) -> Image:
        """Return a frame, or the place, as a camera sees it."""
        if number < self.since:
            return super().image(number)
        noise = _rng(number).normal(0.0, LEFT_NOISE, self._place.shape)
        return np.clip(np.round(self._place + noise), 0, 255).astype(np.uint8)

    def truth(self, number: int) -> Image | None:
        """Return the truth of a frame, nobody later."""
        if number < self.since:
            return super().truth(number)
        return np.zeros(self.size[::-1], np.uint8)

    @cached_property
    def _place(self) -> NDArray[np.float32]:
        """Return the picture of the place without people, (H, W, 3)."""
        numbers = self.whole.numbers
        numbers = numbers[:: max(1, len(numbers) // PLACE_FRAMES)]
        images = np.stack([self.whole.image(n) for n in numbers]).astype(np.float32)
        near = np.ones((LEFT_NEAR_PX, LEFT_NEAR_PX), np.uint8)
        for image, truth in zip(images, map(self.whole.truth, numbers), strict=True):
            if truth is not None:
                image[cv2.dilate(truth, near) > 0] = np.nan
        with warnings.catch_warnings():
            warnings.simplefilter('ignore', RuntimeWarning)  # where somebody always was
            place = np.nanmedian(images, axis=0)
        unknown = np.isnan(place).any(2).astype(np.uint8)
        filled = cv2.inpaint(np.nan_to_num(place).astype(np.uint8), unknown, 5, cv2.INPAINT_TELEA)
        return filled.astype(np.float32)


def _heat(labels: Image, number: int) -> Image:
    """Return a map that does not tell people apart: all of them, blurred, some blocks inverted."""
    people = np.where((labels > 0) & (labels <= MOST_PEOPLE), 255, 0).astype(np.uint8)
    soft = np.asarray(cv2.GaussianBlur(people, (0, 0), SOFT), np.uint8)
    wrong = _rng(number).random([math.ceil(size / BLOCK) for size in soft.shape]) < INVERTED
    blocks = np.kron(wrong, np.ones((BLOCK, BLOCK), bool))[: soft.shape[0], : soft.shape[1]]
    return np.where(blocks, 255 - soft, soft).astype(np.uint8)
