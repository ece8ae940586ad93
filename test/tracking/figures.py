# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Coloured figures before a textured wall, and a tracker that is told the true masks."""

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import cycle

import cv2
import numpy as np

from gait_segmentation.detector.detection import Detection
from gait_segmentation.detector.networks import DetectorConfig, Networks
from gait_segmentation.detector.scheduler import DetectorScheduler
from gait_segmentation.geometry import BodyFrame, Box
from gait_segmentation.results import Feedback, TrackResult
from gait_segmentation.tracking import PeopleTracker, TrackingConfig
from test.walkers import small_bank

WIDTH, HEIGHT = 320, 180
STEP_NS = 40_000_000

STRIDES = [0.1, 0.11, 0.12, 0.13, 0.14, 0.15, 0.16, 0.15, 0.14, 0.13, 0.12, 0.11]
"""How far the feet are apart in the frames of a step, in heights of the figure."""

RED, BLUE, GREEN = (40, 40, 200), (190, 60, 30), (50, 170, 60)


@cache
def wall() -> np.ndarray:
    """Return a wall with texture that flow can follow."""
    small = np.random.default_rng(3).integers(90, 150, (HEIGHT // 6, WIDTH // 6, 3))
    return cv2.resize(small.astype(np.uint8), (WIDTH, HEIGHT), interpolation=cv2.INTER_CUBIC)


@dataclass(frozen=True)
class Figure:
    """Somebody in a coat of one colour and dark trousers, lit unevenly."""

    x: float
    coat: tuple[int, int, int] = RED
    y: float = 90.0
    height: float = 100.0
    stride: float = 0.1

    def mask(self) -> np.ndarray:
        mask = np.zeros((HEIGHT, WIDTH), np.uint8)
        x, y, h = round(self.x), round(self.y), self.height
        cv2.circle(mask, (x, round(y - 0.41 * h)), round(0.08 * h), 255, -1)
        cv2.ellipse(
            mask, (x, round(y - 0.12 * h)), (round(0.13 * h), round(0.24 * h)), 0, 0, 360, 255, -1
        )
        for side in (-1, 1):
            foot = (round(x + side * self.stride * h), round(y + 0.48 * h))
            cv2.line(mask, (x, y), foot, 255, round(0.1 * h))
        return mask

    @property
    def box(self) -> Box:
        return Box.around(self.mask())

    def draw(self, image: np.ndarray) -> None:
        # Only of the pixels that are painted: thousands are drawn.
        mask = self.mask() > 0
        rows, columns = np.nonzero(mask)
        light = 1 + 0.1 * np.sin((columns[:, None] - self.x) / 4)
        colours = np.clip(light * np.array(self.coat), 0, 255).astype(np.uint8)
        colours[rows > self.y + 0.05 * self.height] = (70, 50, 40)
        colours[rows < self.y - 0.33 * self.height] = (120, 150, 210)
        image[mask] = colours


@cache
def noise(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).integers(-2, 3, (HEIGHT, WIDTH, 3)).astype(np.int16)


def picture(
    figures: Iterable[Figure],
    boards: Iterable[tuple[int, int]] = (),
    shift: tuple[int, int] = (0, 0),
) -> tuple[np.ndarray, list[np.ndarray]]:
    """
    Return an image and the visible mask of each figure.

    :param figures: from the farthest to the nearest.
    :param boards: columns that a board before everybody hides, from and to.
    :param shift: of the whole picture, as by a camera that is knocked.
    """
    image = wall().copy()
    masks: list[np.ndarray] = []
    for figure in figures:
        figure.draw(image)
        own = figure.mask()
        masks = [np.where(own > 0, 0, other).astype(np.uint8) for other in masks]
        masks.append(own)
    for left, right in boards:
        image[:, left:right] = (60, 110, 130)
        image[::9, left:right] = (40, 80, 100)
        for mask in masks:
            mask[:, left:right] = 0
    image = np.clip(image + noise(len(masks)), 0, 255).astype(np.uint8)
    if shift != (0, 0):
        image = np.roll(image, shift[::-1], axis=(0, 1))
        masks = [np.roll(mask, shift[::-1], axis=(0, 1)) for mask in masks]
    return image, masks


def blind() -> DetectorScheduler:
    """Return a detector that never sees anybody."""
    return DetectorScheduler(DetectorConfig(network='none'))


def watched(boxes: list[Box], slots: int = 1, period: float = 0.02, **tracking) -> 'Told':
    """Return a tracker with a detector that looks so often, and sees what is in a list."""
    config = DetectorConfig(calm_period=period, urgent_period=period)
    networks = Networks(lambda image: [Detection(box, 0.9) for box in boxes])
    return Told(slots, scheduler=DetectorScheduler(config, networks), **tracking)


class Told:
    """A tracker that is told the true masks, frame by frame, or so many frames late."""

    def __init__(
        self,
        slots: int = 1,
        late: int = 0,
        scheduler: DetectorScheduler | None = None,
        **tracking,
    ) -> None:
        self.tracker = PeopleTracker(
            small_bank(),
            TrackingConfig(**tracking),
            max_people=slots,
            scheduler=scheduler or blind(),
        )
        self.frames = 0
        self._late, self._waiting = late, deque[list[Feedback]]()

    @property
    def stamp_ns(self) -> int:
        return (self.frames + 1) * STEP_NS

    def start(self, *figures: Figure) -> None:
        for figure in figures:
            self.tracker.initialize(figure.box)

    def see(
        self,
        image: np.ndarray,
        masks: Sequence[np.ndarray],
        bodies: Sequence[np.ndarray] | None = None,
    ) -> list[TrackResult]:
        """
        Give an image, and the true masks of those who are tracked back.

        :param bodies: the masks with what is hidden, for templates; the masks if None.
        """
        results = self.tracker.update(image, self.stamp_ns)
        self.frames += 1
        feedback = []
        for slot, result in enumerate(results):
            if result.track_id == 0:
                continue
            mask = whole = np.zeros(image.shape[:2], np.uint8)
            if result.state == 'tracked' and slot < len(masks):
                mask = masks[slot]
                whole = mask if bodies is None else bodies[slot]
            box = Box.around(whole)
            body = None if box is None else BodyFrame(box.center_x, box.center_y, box.height)
            size = result.likelihood.shape[::-1]
            prior = np.asarray(cv2.resize(whole, size, interpolation=cv2.INTER_AREA))
            feedback.append(Feedback(result.stamp_ns, result.track_id, mask, body, prior))
        self._waiting.append(feedback)
        if len(self._waiting) > self._late:
            self.tracker.learn(self._waiting.popleft())
        return results

    def follow(self, path: Sequence[Figure], **options) -> list[TrackResult]:
        """Start somebody at the beginning of a path; return what is said of them along it."""
        self.start(path[0])
        return [self.show(figure, **options)[0] for figure in path]

    def show(self, *figures: Figure, **options) -> list[TrackResult]:
        """Give a picture of some figures, from the farthest to the nearest."""
        return self.see(*picture(figures, **options))


def walk(figure: Figure, frames: int, speed: float = 3.0) -> list[Figure]:
    """Return a figure in each frame of a walk."""
    return [replace(figure, x=figure.x + speed * number) for number in range(frames)]


def step(figures: Iterable[Figure]) -> list[Figure]:
    """Return a figure in each frame with feet that come together and apart."""
    return [
        replace(figure, stride=stride)
        for figure, stride in zip(figures, cycle(STRIDES), strict=False)
    ]


def ids(results: Iterable[TrackResult]) -> list[int]:
    return [result.track_id for result in results]
