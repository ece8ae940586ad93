# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Clips of things that move and are nobody: cars, trolleys, doors, curtains, dogs, bands of light.

Each is drawn as polygons, in heights of the thing: x to the right of its middle, y upwards from
the ground.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.synthetic.scenery import make_panorama, muted_colour, value_noise
from gait_tools.evaluation.sequence import frame_stamp_ns
from gait_tools.gait_model import FIGURES, render_silhouette

Polygon = NDArray[np.float64]
Shape = Callable[[float], list[Polygon]]
"""The (n, 2) polygons of a thing at a time in seconds."""

_WIDTH, _HEIGHT, _FPS, _FRAMES = 320, 240, 25.0, 75
_MARGIN = 60
"""Pixels that the place is wider than a frame on each side, for a camera that pans."""

_TEXTURE = 256
_BITS = 4
"""Binary digits after the point of polygons' corners."""


def _rectangle(left: float, right: float, bottom: float, top: float) -> Polygon:
    return np.array([(left, bottom), (right, bottom), (right, top), (left, top)], np.float64)


def _oval(x: float, y: float, across: float, up: float) -> Polygon:
    """Return an ellipse by its middle and half axes."""
    turn = np.linspace(0, 2 * np.pi, 32, endpoint=False)
    return np.stack([x + across * np.cos(turn), y + up * np.sin(turn)], axis=1)


def _limb(x: float, y: float, angle: float, length: float, width: float) -> Polygon:
    """Return a bar that hangs from a point, turned to the right by an angle in radians."""
    along = np.array([math.sin(angle), -math.cos(angle)])
    side = np.array([along[1], -along[0]]) * width / 2
    top = np.array([x, y])
    return np.array(
        [top - side, top + side, top + length * along + side, top + length * along - side]
    )


def _box(rng: np.random.Generator) -> Shape:
    half = rng.uniform(0.15, 0.5)
    return lambda _: [_rectangle(-half, half, 0, 1)]


def _ball(rng: np.random.Generator) -> Shape:
    half = rng.uniform(0.18, 0.5)
    return lambda _: [_oval(0, 0.5, half, 0.5)]


def _car(rng: np.random.Generator) -> Shape:
    long = rng.uniform(1.1, 1.5)
    roof = np.array([(-0.8, 0.55), (-0.5, 1.0), (0.4, 1.0), (0.75, 0.55)]) * (long / 1.3, 1)
    wheels = [_oval(side * 0.6 * long, 0.15, 0.16, 0.15) for side in (-1, 1)]
    return lambda _: [_rectangle(-long, long, 0.12, 0.58), roof, *wheels]


def _van(rng: np.random.Generator) -> Shape:
    long = rng.uniform(0.45, 1.0)
    wheels = [_oval(side * 0.6 * long, 0.1, 0.11, 0.1) for side in (-1, 1)]
    return lambda _: [_rectangle(-long, long, 0.1, 1), *wheels]


def _trolley(rng: np.random.Generator) -> Shape:
    half = rng.uniform(0.2, 0.4)
    basket = np.array([(-half, 0.45), (half, 0.5), (1.1 * half, 0.9), (-1.1 * half, 1.0)])
    legs = [_limb(side * 0.7 * half, 0.5, side * 0.15, 0.42, 0.07) for side in (-1, 1)]
    wheels = [_oval(side * 0.85 * half, 0.05, 0.06, 0.05) for side in (-1, 1)]
    return lambda _: [basket, *legs, *wheels]


def _wheelchair(rng: np.random.Generator) -> Shape:
    lean = rng.uniform(-0.1, 0.1)
    body = [
        _oval(lean - 0.05, 0.9, 0.09, 0.1), _rectangle(-0.2, 0.1, 0.4, 0.82),
        _rectangle(-0.1, 0.35, 0.35, 0.5), _rectangle(0.25, 0.36, 0.05, 0.45),
        _oval(-0.1, 0.25, 0.25, 0.25), _oval(0.25, 0.07, 0.07, 0.07),
    ]  # fmt: skip
    return lambda _: body


def _capsule(rng: np.random.Generator) -> Shape:
    half, gap = rng.uniform(0.13, 0.24), rng.uniform(0.08, 0.3)
    parts = [_oval(0, 1 - half, half, half), _rectangle(-half, half, gap, 1 - half)]
    legs = [_rectangle(s * 0.6 * half - 0.04, s * 0.6 * half + 0.04, 0, gap) for s in (-1, 1)]
    return lambda _: [*parts, *legs]


def _figure(rng: np.random.Generator) -> Shape:
    """A figure of a walker that is pushed along."""
    phase, azimuth = float(rng.uniform()), float(rng.choice([0.0, math.pi, 0.7, -1.5]))
    drawn = render_silhouette(phase, azimuth, 200.0, build=str(rng.choice(FIGURES)))
    contours, _ = cv2.findContours(
        (drawn > 127).astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE
    )
    outline = max(contours, key=len)[:, 0].astype(np.float64)
    bottom, top = outline[:, 1].max(), outline[:, 1].min()
    outline = (outline - (outline[:, 0].mean(), bottom)) * (1, -1) / (bottom - top)
    return lambda _: [outline]


def _dog(rng: np.random.Generator) -> Shape:
    rate, start = rng.uniform(1.2, 2.0), rng.uniform(0, 6)
    half = rng.uniform(0.45, 0.7)

    def at(seconds: float) -> list[Polygon]:
        swing = 0.5 * math.sin(2 * math.pi * rate * seconds + start)
        legs = [
            _limb(x * half, 0.5, side * swing, 0.5, 0.12)
            for x in (-0.75, 0.75)
            for side in (-1, 1)
        ]
        return [_oval(0, 0.6, half, 0.19), _oval(1.05 * half, 0.85, 0.17, 0.14), *legs]

    return at


def _tree(rng: np.random.Generator) -> Shape:
    rate, lean = rng.uniform(0.3, 0.9), rng.uniform(0.1, 0.3)
    crown = np.stack([0.42 * np.cos(turn := np.linspace(0, 2 * np.pi, 24, endpoint=False)),
                      0.66 + 0.33 * np.sin(turn)], axis=1)  # fmt: skip
    crown += rng.normal(0, 0.03, crown.shape)

    def at(seconds: float) -> list[Polygon]:
        shear = lean * math.sin(2 * math.pi * rate * seconds)
        parts = [crown, _rectangle(-0.04, 0.04, 0, 0.5)]
        return [part + np.outer(part[:, 1], (shear, 0)) for part in parts]

    return at


def _curtain(rng: np.random.Generator) -> Shape:
    rate, far, half = rng.uniform(0.5, 1.2), rng.uniform(0.08, 0.25), rng.uniform(0.15, 0.3)

    def at(seconds: float) -> list[Polygon]:
        down = np.linspace(1, 0, 12)
        phase = 2 * math.pi * (rate * seconds - 0.4 * down)
        left = -half + far * (1 - down) * np.sin(phase)
        right = half + far * (1 - down) * np.sin(phase + 1.0)
        sides = [np.stack([left, down], axis=1), np.stack([right, down], axis=1)[::-1]]
        return [np.concatenate(sides)]

    return at


def _pendulum(rng: np.random.Generator) -> Shape:
    rate, far = rng.uniform(0.5, 1.1), rng.uniform(0.25, 0.6)
    bob = rng.uniform(0.1, 0.2)

    def at(seconds: float) -> list[Polygon]:
        angle = far * math.sin(2 * math.pi * rate * seconds)
        x, y = math.sin(angle) * (1 - bob), 1 - math.cos(angle) * (1 - bob)
        return [_limb(0, 1, angle, 1 - bob, 0.06), _oval(x, y, bob, bob)]

    return at


def _bag(rng: np.random.Generator) -> Shape:
    """A figure that hangs by its head and swings."""
    figure, rate, far = _figure(rng)(0)[0], rng.uniform(0.5, 1.1), rng.uniform(0.12, 0.3)

    def at(seconds: float) -> list[Polygon]:
        angle = far * math.sin(2 * math.pi * rate * seconds)
        turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
        return [(figure - (0, 1)) @ turn + (0, 1)]

    return at


def _door(rng: np.random.Generator) -> Shape:
    wide, lasts = rng.uniform(0.35, 0.5), rng.uniform(0.8, 2.0)

    def at(seconds: float) -> list[Polygon]:
        angle = 0.5 * math.pi * min(seconds / lasts, 0.95)
        x, off = wide * math.cos(angle), 0.1 * math.sin(angle)
        return [np.array([(0, 0), (0, 1), (x, 1 + off), (x, -off)])]

    return at


def _band(rng: np.random.Generator) -> Shape:
    lean, half = rng.uniform(-0.3, 0.3), rng.uniform(0.1, 0.3)
    return lambda _: [np.array([(-half, 0), (half, 0), (half + lean, 1), (-half + lean, 1)])]


def _looming(rng: np.random.Generator) -> Shape:
    """A box that comes closer."""
    half, rate = rng.uniform(0.15, 0.5), rng.uniform(0.1, 0.35)
    return lambda seconds: [_rectangle(-half, half, -0.1, 1) * math.exp(rate * min(seconds, 3.0))]


def _wheel(rng: np.random.Generator) -> Shape:
    """Spokes that turn as they roll."""
    count, rate = int(rng.integers(3, 7)), rng.uniform(0.4, 0.9)

    def at(seconds: float) -> list[Polygon]:
        turns = 2 * math.pi * (np.arange(count) / count + rate * seconds)
        return [_oval(0, 0.5, 0.12, 0.12), *(_limb(0, 0.5, a, 0.5, 0.12) for a in turns)]

    return at


THINGS: dict[str, tuple[Callable[[np.random.Generator], Shape], bool]] = {
    'box': (_box, True),
    'ball': (_ball, True),
    'car': (_car, True),
    'van': (_van, True),
    'trolley': (_trolley, True),
    'wheelchair': (_wheelchair, True),
    'capsule': (_capsule, True),
    'figure': (_figure, True),
    'dog': (_dog, True),
    'wheel': (_wheel, True),
    'looming': (_looming, True),
    'band': (_band, True),
    'tree': (_tree, False),
    'curtain': (_curtain, False),
    'pendulum': (_pendulum, False),
    'bag': (_bag, False),
    'door': (_door, False),
}
"""Name -> what makes the shape by lot, and whether the thing moves along."""


class ThingClip:
    """Frames of 320 x 240 in which one thing moves; the same name and seed give the same bits."""

    def __init__(self, name: str, seed: int = 0) -> None:
        """Draw place and thing by lot; in odd seeds the thing first stands still for a time."""
        self.name = f'{name}-{seed}'
        make, goes = THINGS[name]
        rng = np.random.default_rng([seed, list(THINGS).index(name)])
        self._shape = make(rng)
        self._height = rng.uniform(60, 140)
        self._rest = rng.uniform(0.15, 0.6) if seed % 2 else 0.0
        self._pan = float(rng.choice([-1.2, 1.2])) if seed % 4 == 3 else 0.0
        self._speed = float(rng.choice([-1, 1]) * rng.uniform(0.4, 1.3)) if goes else 0.0
        self._ground = rng.uniform(0.8, 0.97) * _HEIGHT
        self._band = name == 'band'
        wide = _WIDTH + 2 * _MARGIN
        self._place = make_panorama(rng, (_HEIGHT, wide), round(self._ground), 100, 0.5)
        self._colour = (
            muted_colour(rng) + 9 * value_noise(rng, (_TEXTURE, _TEXTURE), 60)[..., None]
        )
        # Before a place of nearly the same colour it only stands out in parts.
        self._opacity = float(rng.uniform(0.25, 1.0))
        self._middle = _WIDTH / 2 + rng.uniform(-0.2, 0.2) * _WIDTH
        if goes:
            # Half way through what it goes it is in the middle.
            gone = self._speed * self._height * (_FRAMES / _FPS - self._rest)
            self._middle -= min(max(gone / 2, -0.4 * _WIDTH), 0.4 * _WIDTH)
        self._seed = seed

    def __iter__(self) -> Iterator[tuple[NDArray[np.uint8], int]]:
        """Go through frames, (240, 320, 3) uint8 BGR, and their stamps in nanoseconds."""
        for number in range(_FRAMES):
            yield self._draw(number), frame_stamp_ns(number, _FPS)

    def _draw(self, number: int) -> NDArray[np.uint8]:
        seconds = max(number / _FPS - self._rest, 0.0)
        pan = self._pan * number
        left = _MARGIN + (pan - math.copysign(_MARGIN * 0.7, self._pan) if self._pan else 0.0)
        size = (_WIDTH, _HEIGHT)
        move = np.array([[1.0, 0, -left], [0, 1.0, 0]])
        picture = cv2.warpAffine(self._place, move, size, borderMode=cv2.BORDER_REFLECT).astype(
            np.float32
        )
        x = self._middle + self._speed * self._height * seconds - pan
        cover = np.zeros((_HEIGHT, _WIDTH), np.uint8)
        for polygon in self._shape(seconds):
            corners = polygon * (self._height, -self._height) + (x, self._ground)
            points = np.rint(corners * (1 << _BITS)).astype(np.int32)
            cv2.fillPoly(cover, [points], 255, cv2.LINE_AA, _BITS)
        alpha = (cover / np.float32(255))[..., None]
        if self._band:
            picture *= 1 + 0.35 * cv2.GaussianBlur(alpha, (0, 0), 4)[..., None]
        else:
            move = np.array([[1.0, 0, x - _TEXTURE / 2], [0, 1.0, self._ground - _TEXTURE * 0.9]])
            colour = cv2.warpAffine(
                self._colour.astype(np.float32), move, size, borderMode=cv2.BORDER_REFLECT
            )
            picture += self._opacity * alpha * (colour - picture)
        picture = cv2.GaussianBlur(picture, (0, 0), 0.5)
        noise = np.random.default_rng([self._seed, number]).standard_normal(picture.shape)
        return np.clip(np.rint(picture + 3 * noise), 0, 255).astype(np.uint8)
