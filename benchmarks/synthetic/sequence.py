# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Synthetic sequences with exact truth: dressed walkers of the gait model before a cluttered wall.

Walkers are drawn without perspective within the body, but grow and shrink with their distance.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import yaml
from numpy.typing import NDArray

from benchmarks.synthetic.scenery import make_panorama
from benchmarks.synthetic.walkers import Walker, draw_walker, make_outfit
from gait_segmentation.errors import SequenceError
from gait_segmentation.geometry import BodyFrame, Box
from gait_tools.evaluation.metrics import AMBIGUOUS, PERSON, UNCLEAR
from gait_tools.evaluation.sequence import frame_stamp_ns
from gait_tools.gait_model import FIGURES
from gait_tools.outputs import write, write_image

EYE_LEVEL = 0.9
"""Height of the camera above the ground, in statures."""

FOCAL_LENGTH = 1.1
"""In image widths."""

NEAREST = 0.3
"""Share of the first walker's distance at which people have walked past the camera."""

WALL_DISTANCE = 1.35
"""Of the wall over that of the first walker."""

MIXED = (13, 242)
"""Pixels covered more than the first and less than the second (of 255) are ambiguous."""


@dataclass(frozen=True)
class SyntheticConfig:
    """
    Parameters of a clip; sizes in pixels, deviations are standard deviations.

    ``person_height`` is that of the first walker half way, who walks towards ``azimuth`` (radians:
    0 right, pi/2 away, -pi/2 closer) with ``stride_rate`` strides (two steps) a second; ``pan`` is
    how far the camera moves to the right a frame, seen on that walker.
    """

    seed: int = 0
    width: int = 320
    height: int = 240
    fps: float = 25.0
    frames: int = 50
    person_height: float = 120.0
    azimuth: float = 0.0
    stride_rate: float = 0.9
    build: str = 'average'
    walkers: int = 1
    pan: float = 0.0
    jitter: float = 0.3
    """Deviation of the camera's shake."""

    clutter: float = 0.5
    """Things before the wall: 0 none, 1 crowded."""

    shadow: bool = False
    """Whether walkers cast soft shadows."""

    noise: float = 3.0
    """Deviation of the sensor's noise, grey levels."""

    blur: float = 0.5
    """Deviation of the lens's blur."""


class SyntheticCamera:
    """
    Where things of the place are seen, in pixels.

    ``distance`` is that of the first walker half way, in statures; ``margin_x`` and ``margin_y``
    are what pictures of the whole place, such as a panorama, have on each side beyond the image.
    """

    def __init__(self, config: SyntheticConfig, rng: np.random.Generator) -> None:
        """Draw the shake."""
        self._config = config
        self._focal = FOCAL_LENGTH * config.width
        # Level with the middle of the first walker's way, so that feet and head have room.
        self._horizon = config.height / 2 + (0.5 - EYE_LEVEL) * config.person_height
        self.distance = self._focal / config.person_height
        self._shake = _shake(config.jitter, rng.standard_normal((config.frames, 2)))
        moved = 4 * config.jitter + 4
        self.margin_y = math.ceil(moved)
        self.margin_x = math.ceil(abs(config.pan) * config.frames / 2 + moved)

    @property
    def place_shape(self) -> tuple[int, int]:
        """Return rows and columns of a picture of the whole place."""
        config = self._config
        return config.height + 2 * self.margin_y, config.width + 2 * self.margin_x

    def height_at(self, distance: float) -> float:
        """Return how many pixels a stature is at a distance in statures."""
        return self._focal / distance

    def ground_at(self, distance: float) -> float:
        """Return the row, in a picture of the whole place, of the ground at a distance."""
        return self._horizon + EYE_LEVEL * self.height_at(distance) + self.margin_y

    def body_at(self, x: float, z: float, number: int) -> BodyFrame:
        """Return where somebody at (x, z) is seen in a frame."""
        height = self.height_at(z)
        dx, dy = self._shift(number, self.distance / z)
        center_y = self._horizon + (EYE_LEVEL - 0.5) * height
        return BodyFrame(self._config.width / 2 + x * height + dx, center_y + dy, height)

    def view(self, picture: NDArray[np.generic], number: int, share: float) -> NDArray[np.float32]:
        """
        Cut what a frame shows out of a picture of the whole place.

        :param share: speed with which the picture passes, over that of the first walker's.
        """
        dx, dy = self._shift(number, share)
        matrix = np.array([[1, 0, dx - self.margin_x], [0, 1, dy - self.margin_y]])
        size = (self._config.width, self._config.height)
        moved = cv2.warpAffine(
            picture, matrix, size, flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE
        )
        return np.asarray(moved, np.float32)

    def _shift(self, number: int, share: float) -> tuple[float, float]:
        """Return how far the picture moves; near things (share 1) pass faster than the wall."""
        passed = self._config.pan * (number - (self._config.frames - 1) / 2)
        return share * -passed + self._shake[number, 0], float(self._shake[number, 1])


def _shake(jitter: float, steps: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (frames, 2) displacements of the picture, correlated as a hand's are."""
    shake = np.zeros_like(steps)
    for number in range(1, len(steps)):
        shake[number] = 0.8 * shake[number - 1] + 0.6 * steps[number]
    return np.clip(jitter * shake, -3 * jitter, 3 * jitter)


@dataclass(frozen=True)
class SyntheticFrame:
    """
    One frame and its truth, per walker in the order of the walkers.

    ``image`` is (H, W, 3) uint8 BGR; ``masks`` are (H, W) uint8 0/255, the pixels at least half
    covered by what can be seen of the walker; ``truths`` the same with 170 for mixed pixels;
    ``labels`` is (H, W) uint8, 0 or walker + 1, ``true_labels`` the same with 255 for mixed
    pixels.  ``boxes`` are tight about the masks, None where
    nothing can be seen.  ``phases`` are those of :class:`~gait_segmentation.results.MatchResult`
    (0 = heel contact of the leg nearer to the camera), ``azimuths`` in radians.
    """

    number: int
    stamp_ns: int
    image: NDArray[np.uint8]
    labels: NDArray[np.uint8]
    true_labels: NDArray[np.uint8]
    masks: tuple[NDArray[np.uint8], ...]
    truths: tuple[NDArray[np.uint8], ...]
    boxes: tuple[Box | None, ...]
    phases: tuple[float, ...]
    azimuths: tuple[float, ...]


class SyntheticSequence:
    """
    Frames of a made-up clip; the same configuration gives the same bits.

    Frames can be asked for in any order.  ``walkers`` are the people; the first is the one to
    track where only one is.
    """

    def __init__(self, config: SyntheticConfig | None = None) -> None:
        """Draw the place and the people."""
        self.config = config or SyntheticConfig()
        rng = np.random.default_rng(self.config.seed)
        self.walkers = draw_walkers(rng, self.config)
        self._camera = camera = SyntheticCamera(self.config, rng)
        wall = WALL_DISTANCE * camera.distance
        ground, unit = round(camera.ground_at(wall)), camera.height_at(wall)
        self._panorama = make_panorama(rng, camera.place_shape, ground, unit, self.config.clutter)
        self._last: SyntheticFrame | None = None

    @property
    def initial_box(self) -> Box | None:
        """Return the box of the first walker in the first frame, None if not to be seen."""
        return self.frame(0).boxes[0]

    def __iter__(self) -> Iterator[SyntheticFrame]:
        """Go through the frames in order."""
        return (self.frame(number) for number in range(self.config.frames))

    def frame(self, number: int) -> SyntheticFrame:
        """
        Draw a frame.

        :raises IndexError: if there is no such frame.
        """
        if not 0 <= number < self.config.frames:
            raise IndexError(f'frame must be from 0 to {self.config.frames - 1}, got {number}')
        if self._last is None or self._last.number != number:
            self._last = self._draw(number)
        return self._last

    def write(self, folder: str | Path) -> None:
        """
        Write the clip as a sequence folder, with the labels of all walkers.

        ``masks`` have the truth of the first.  If that one is seen in the first frame, the folder
        has the ``initial_box``.

        :raises SequenceError: if it cannot be written or nobody is ever to be seen.
        """
        folder = Path(folder)
        seen = False
        for frame in self:
            name = f'{frame.number:04d}.png'
            write_image(folder / 'frames' / name, frame.image)
            write_image(folder / 'masks' / name, frame.truths[0])
            write_image(folder / 'labels' / name, frame.true_labels)
            seen = seen or any(box is not None for box in frame.boxes)
        if not seen:
            raise SequenceError(f'{folder}: nobody is to be seen in any frame')
        about: dict[str, Any] = {'name': folder.name, 'fps': self.config.fps}
        box = self.initial_box
        if box is not None:
            about['initial_box'] = [box.x, box.y, box.width, box.height]
        about['initial_frame'] = 0
        about['notes'] = f'synthetic, seed {self.config.seed}'
        about['labels'] = {'background': 0, 'ambiguous': AMBIGUOUS, 'person': PERSON}
        write(folder / 'sequence.yaml', yaml.safe_dump(about, sort_keys=False).encode())

    def seconds(self, number: int) -> float:
        """Return the time of a frame after half way of the clip."""
        return (number - (self.config.frames - 1) / 2) / self.config.fps

    def _draw(self, number: int) -> SyntheticFrame:
        seconds = self.seconds(number)
        picture = self._camera.view(self._panorama, number, 1 / WALL_DISTANCE)
        seen = [np.zeros(picture.shape[:2], np.float32) for _ in self.walkers]
        places = [each.place_at(seconds) for each in self.walkers]
        # The farthest first.
        for index in sorted(range(len(places)), key=lambda index: -places[index][1]):
            walker, (x, z) = self.walkers[index], places[index]
            if z < NEAREST * self._camera.distance:
                continue
            body = self._camera.body_at(x, z, number)
            phase = walker.phase_at(seconds)
            cover = draw_walker(picture, walker, body, phase, self.config.shadow)
            for behind in seen:
                behind *= 1 - cover
            seen[index] = cover
        return self._finish(number, picture, seen)

    def _finish(
        self, number: int, picture: NDArray[np.float32], seen: list[NDArray[np.float32]]
    ) -> SyntheticFrame:
        if self.config.blur > 0:
            picture = np.asarray(cv2.GaussianBlur(picture, (0, 0), self.config.blur))
        seconds = self.seconds(number)
        rng = np.random.default_rng([self.config.seed, number])
        noise = rng.standard_normal(picture.shape, dtype=np.float32)
        image = np.clip(np.rint(picture + self.config.noise * noise), 0, 255).astype(np.uint8)
        cover = np.rint(255 * np.array(seen)).astype(np.uint8)
        masks = tuple(np.where(alpha > 127, 255, 0).astype(np.uint8) for alpha in cover)
        mixed = (cover > MIXED[0]) & (cover < MIXED[1])
        labels = np.zeros(picture.shape[:2], np.uint8)
        for index, mask in enumerate(masks):
            labels[mask > 0] = index + 1
        return SyntheticFrame(
            number=number,
            stamp_ns=frame_stamp_ns(number, self.config.fps),
            image=image,
            labels=labels,
            true_labels=np.where(mixed.any(axis=0), UNCLEAR, labels).astype(np.uint8),
            masks=masks,
            truths=tuple(
                np.where(rim, AMBIGUOUS, mask).astype(np.uint8)
                for rim, mask in zip(mixed, masks, strict=True)
            ),
            boxes=tuple(Box.around(mask) for mask in masks),
            phases=tuple(walker.near_phase_at(seconds) for walker in self.walkers),
            azimuths=tuple(walker.azimuth for walker in self.walkers),
        )


def draw_walkers(rng: np.random.Generator, config: SyntheticConfig) -> list[Walker]:
    """Make the first walker, and people who cross to the left or right, nearer or farther."""
    distance = FOCAL_LENGTH * config.width / config.person_height
    way = (0.0, distance, config.azimuth, config.stride_rate, rng.uniform())
    walkers = [Walker(*way, config.build, make_outfit(rng, config.build))]
    for _ in range(config.walkers - 1):
        nearer = rng.uniform(0.8, 1.3)
        build = str(rng.choice(FIGURES))
        way = (
            distance / FOCAL_LENGTH / 2 * nearer * rng.uniform(-0.8, 0.8),
            distance * nearer,
            float(rng.choice([0.0, math.pi]) + rng.uniform(-0.3, 0.3)),
            config.stride_rate * rng.uniform(0.85, 1.15),
            rng.uniform(),
        )
        walkers.append(Walker(*way, build, make_outfit(rng, build)))
    return walkers
