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

from benchmarks.synthetic.camera import FOCAL_LENGTH, SyntheticCamera, SyntheticConfig
from benchmarks.synthetic.clothing import make_outfit
from benchmarks.synthetic.scenery import make_panorama
from benchmarks.synthetic.walkers import Walker, draw_walker
from gait_segmentation.errors import SequenceError
from gait_segmentation.files.output_files import write_file
from gait_segmentation.geometry import Box
from gait_tools.evaluation.metrics import AMBIGUOUS, PERSON, UNCLEAR
from gait_tools.evaluation.report import write_image
from gait_tools.evaluation.sequence import frame_stamp_ns
from gait_tools.gait_model import FIGURES
from gait_tools.outputs import writing

NEAREST = 0.3
"""Share of the first walker's distance at which people have walked past the camera."""

WALL_DISTANCE = 1.35
"""Of the wall over that of the first walker."""

MIXED = (13, 242)
"""Pixels covered more than the first and less than the second (of 255) are ambiguous."""


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
    def numbers(self) -> list[int]:
        """Return the numbers of the frames."""
        return list(range(self.config.frames))

    @property
    def initial_box(self) -> Box | None:
        """Return the box of the first walker in the first frame, None if not to be seen."""
        return self.frame(0).boxes[0]

    def stamp_ns(self, number: int) -> int:
        """Return the stamp of a frame in nanoseconds."""
        return frame_stamp_ns(number, self.config.fps)

    def __len__(self) -> int:
        """Return the number of frames."""
        return self.config.frames

    def __iter__(self) -> Iterator[SyntheticFrame]:
        """Go through the frames in order."""
        return (self.frame(number) for number in self.numbers)

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
        path = folder / 'sequence.yaml'
        with writing(path):
            write_file(path, yaml.safe_dump(about, sort_keys=False).encode())

    def seconds(self, number: int) -> float:
        """Return the time of a frame after half way of the clip."""
        return (number - (self.config.frames - 1) / 2) / self.config.fps

    def _draw(self, number: int) -> SyntheticFrame:
        seconds = self.seconds(number)
        picture = self._camera.view(self._panorama, number, 1 / WALL_DISTANCE)
        seen = [np.zeros(picture.shape[:2], np.float32) for _ in self.walkers]
        # The farthest first.
        for index, each in sorted(enumerate(self.walkers), key=lambda it: -it[1].at(seconds).z):
            where = each.at(seconds)
            if where.z < NEAREST * self._camera.distance:
                continue
            body = self._camera.body_at(where.x, where.z, number)
            cover = draw_walker(picture, each, body, where, self.config.shadow)
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
            stamp_ns=self.stamp_ns(number),
            image=image,
            labels=labels,
            true_labels=np.where(mixed.any(axis=0), UNCLEAR, labels).astype(np.uint8),
            masks=masks,
            truths=tuple(
                np.where(rim, AMBIGUOUS, mask).astype(np.uint8)
                for rim, mask in zip(mixed, masks, strict=True)
            ),
            boxes=tuple(Box.around(mask) for mask in masks),
            phases=tuple(walker.near_phase(seconds) for walker in self.walkers),
            azimuths=tuple(walker.at(seconds).azimuth for walker in self.walkers),
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
