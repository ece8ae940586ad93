# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures, maps and boxes by lot."""

from __future__ import annotations

import math
from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model import BankSpec, TemplateBank, build_bank
from gait_segmentation.geometry import Box

__all__ = [
    'Film',
    'Image',
    'Rng',
    'box_by_lot',
    'map_by_lot',
    'reduced',
    'shape_by_lot',
    'walkers',
]

Image = NDArray[np.uint8]
Rng = np.random.Generator


def flat(rng: Rng, shape: tuple[int, int]) -> Image:
    level = rng.choice([0, 1, 127, 254, 255, int(rng.integers(256))])
    colour = rng.integers(0, 256, 3) if rng.random() < 0.3 else np.full(3, level)
    return np.broadcast_to(colour.astype(np.uint8), (*shape, 3)).copy()


def noise(rng: Rng, shape: tuple[int, int]) -> Image:
    if rng.random() < 0.3:
        return np.asarray(255 * rng.integers(0, 2, (*shape, 3)), np.uint8)
    return rng.integers(0, 256, (*shape, 3), np.uint8)


def gradient(rng: Rng, shape: tuple[int, int]) -> Image:
    along = np.linspace(0, float(rng.choice([1, 255, 1000])), shape[int(rng.integers(2))])
    across = along[:, None] if len(along) == shape[0] else along[None]
    return np.repeat(np.broadcast_to(across % 256, shape)[..., None], 3, axis=2).astype(np.uint8)


def texture(rng: Rng, shape: tuple[int, int]) -> Image:
    cells = rng.integers(40, 220, (max(2, shape[0] // 12), max(2, shape[1] // 12), 3), np.uint8)
    return np.asarray(cv2.resize(cells, shape[::-1], interpolation=cv2.INTER_CUBIC))


_STRIDE = 0.83
"""Length of a stride in body heights."""

SCENERIES = (flat, noise, gradient, texture)


class Walker:
    """Somebody of two colours who is drawn by the templates of one direction."""

    def __init__(self, rng: Rng, shape: tuple[int, int], pace: float = 0.0) -> None:
        """
        Send somebody by lot.

        :param pace: strides a frame of somebody who walks past, well in view; 0 = by lot.
        """
        height, width = shape
        bank = walkers()
        self._fill = bank.fill
        if pace:
            side = int(rng.integers(2))
            self._templates = bank.templates[side * len(bank.templates) // 2]
            self._tall = height * rng.uniform(0.4, 0.7)
            self._at = width * (0.15 + 0.7 * side), height * rng.uniform(0.4, 0.6)
            self._rate, self._growth = pace, 1.0
            self._speed = (1 - 2 * side) * _STRIDE * pace * self._tall
        else:
            self._templates = bank.templates[int(rng.integers(len(bank.templates)))]
            self._tall = max(min(height * rng.uniform(0.2, 1.3), 800.0), 4.0)
            self._at = width * rng.uniform(), height * rng.uniform(0.3, 0.7)
            self._rate = float(rng.uniform(0.02, 0.1))
            self._growth = float(rng.choice([1.0, 1.0, rng.uniform(0.95, 1.05)]))
            self._speed = float(rng.choice([0.0, rng.uniform(-0.08, 0.08)])) * self._tall
        self._colours = rng.integers(0, 256, (2, 3)).astype(np.float32)

    def draw(self, canvas: NDArray[np.float32], number: int) -> Box | None:
        """Draw a frame into a picture, (h, w, 3) float32; return the box of what is seen."""
        phase = number * self._rate % 1.0
        template = self._templates[int(phase * len(self._templates))]
        rows, columns = template.shape
        tall = self._tall * self._growth**number
        scale = tall / (self._fill * rows)
        left = self._at[0] + self._speed * number - scale * columns / 2
        top = self._at[1] - scale * rows / 2
        place = np.array([[scale, 0.0, left], [0.0, scale, top]])
        cover = cv2.warpAffine(template, place, canvas.shape[1::-1]).astype(np.float32) / 255
        upper = min(max(round(self._at[1]), 0), canvas.shape[0])
        for part, colour in zip((slice(0, upper), slice(upper, None)), self._colours, strict=True):
            canvas[part] += cover[part][..., None] * (colour - canvas[part])
        return Box.around(cover > 0.5)


@cache
def walkers() -> TemplateBank:
    """Return the silhouettes that walkers are drawn by."""
    return build_bank(BankSpec(azimuths=8, phases=12))


class Film:
    """Pictures of one size: a scenery, walkers before it, and what may happen to a camera."""

    def __init__(self, rng: Rng, shape: tuple[int, int], pace: float = 0.0) -> None:
        """
        Begin at a place by lot.

        :param pace: strides a frame of people who walk past where little else happens, so that
            they can be found; 0 = anything may happen.
        """
        self.rng, self.shape, self.pace = rng, shape, pace
        self.boxes: list[Box] = []
        self._last: Image | None = None
        self._cut()

    def _cut(self) -> None:
        """Show another place."""
        rng, calm = self.rng, self.pace > 0
        make = SCENERIES[int(rng.integers(len(SCENERIES)))]
        self._scenery = make(rng, self.shape)
        wild = 0.0 if calm else rng.uniform(-40, 40)
        self._pan = float(rng.choice([0.0, 0.0, rng.uniform(-3, 3), wild]))
        self._flickers = not calm and rng.random() < 0.1
        most = 3 if calm else 4
        count = max(int(rng.integers(most)), int(calm))
        self._walkers = [Walker(rng, self.shape, self.pace) for _ in range(count)]

    def picture(self, number: int) -> Image:
        """Return the next picture; ``boxes`` are then those of the walkers in it."""
        rng = self.rng
        chance = rng.random() * (10 if self.pace else 1)
        if chance < 0.05:
            self._cut()
        elif chance < 0.1:
            return flat(rng, self.shape)
        elif chance < 0.2 and self._last is not None:
            return self._last.copy()
        scenery = noise(rng, self.shape) if self._flickers else self._scenery
        if self._pan:
            scenery = np.roll(scenery, round(self._pan * number), axis=1)
        canvas = scenery.astype(np.float32)
        found = [walker.draw(canvas, number) for walker in self._walkers]
        self.boxes = [box for box in found if box is not None]
        gain = 1.0 if chance < 0.8 or self.pace else float(rng.choice([0.3, 2.0]))
        self._last = np.clip(np.rint(gain * canvas), 0, 255).astype(np.uint8)
        return self._last.copy()


def shape_by_lot(rng: Rng) -> tuple[int, int]:
    """Return rows and columns: mostly small ones, which are quick, and some of each kind."""
    kind = rng.choice(['usual', 'tiny', 'large', 'long'], p=[0.62, 0.2, 0.03, 0.15])
    if kind == 'usual':
        return int(rng.integers(60, 241)), int(rng.integers(60, 321))
    if kind == 'tiny':
        return int(rng.integers(16, 49)), int(rng.integers(16, 49))
    if kind == 'large':
        return int(rng.integers(400, 2001)), int(rng.integers(400, 2001))
    sides = int(rng.integers(16, 65)), int(np.exp(rng.uniform(math.log(200), math.log(2000))))
    return sides if rng.random() < 0.5 else sides[::-1]


def map_by_lot(rng: Rng, shape: tuple[int, int]) -> Image:
    """Return an image of one value a pixel: nothing, all, noise, or a blob."""
    kind = int(rng.integers(4))
    if kind < 2:
        return np.full(shape, 255 * kind, np.uint8)
    if kind == 2:
        return rng.integers(0, 256, shape, np.uint8)
    blob = np.zeros(shape, np.uint8)
    middle = (int(rng.integers(shape[1])), int(rng.integers(shape[0])))
    axes = (1 + int(rng.integers(shape[1]) // 6), 1 + int(rng.integers(shape[0]) // 3))
    cv2.ellipse(blob, middle, axes, 0, 0, 360, 255, -1)
    return np.asarray(cv2.blur(blob, (3, 3)))


def reduced(rng: Rng, shape: tuple[int, int]) -> tuple[int, int]:
    """Return a size of the same proportions, at most as large."""
    scale = rng.uniform(0.1, 1.0) if rng.random() < 0.5 else 1.0
    return max(1, round(shape[0] * scale)), max(1, round(shape[1] * scale))


def box_by_lot(rng: Rng, shape: tuple[int, int], known: list[Box]) -> Box:
    """Return a box: of somebody, all, tiny, partly out, anywhere, or far too large."""
    height, width = shape
    kind = int(rng.choice(6, p=[0.4, 0.1, 0.1, 0.15, 0.2, 0.05]))
    if kind == 0 and known:
        box = known[int(rng.integers(len(known)))]
        return box.shifted(rng.normal(0, 0.05) * box.width, rng.normal(0, 0.05) * box.height)
    if kind == 1:
        return Box(0, 0, width, height)
    x, y = width * rng.uniform(-0.1, 1.0), height * rng.uniform(-0.1, 1.0)
    if kind == 2:
        return Box(x, y, rng.uniform(1e-3, 3), rng.uniform(1e-3, 3))
    if kind == 3:
        return Box(x - width / 2, y - height / 2, width * rng.uniform(0.2, 2), height)
    reach = 5.0 if kind == 5 else 1.0
    return Box(x, y, reach * width * rng.uniform(0.01, 1), reach * height * rng.uniform(0.01, 1))
