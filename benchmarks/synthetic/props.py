# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Things that stand or move among made-up people: pillars, cars, trees in the wind."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.synthetic.scenery import muted_colour, value_noise
from gait_segmentation.geometry import BodyFrame

__all__ = ['Prop', 'Stand', 'draw_prop', 'make_car', 'make_pillar', 'make_tree']

_DETAIL = 120
"""Pixels per stature of the pictures of things."""


@dataclass(frozen=True)
class Stand:
    """
    Where a thing is: ``x`` and ``z`` of the middle of its foot in statures.

    ``lean`` is how far its top is to the right of its foot, over its height.
    """

    x: float
    z: float
    lean: float = 0.0


@dataclass(frozen=True)
class Prop:
    """
    A thing without depth that faces the camera and stands on the ground.

    ``colour`` is (h, w, 3) float32 BGR 0..255 and ``alpha`` (h, w) float32 0..1, both with
    ``_DETAIL`` pixels per stature; ``at`` says where it is, given the seconds after half way.
    """

    colour: NDArray[np.float32]
    alpha: NDArray[np.float32]
    at: Callable[[float], Stand]


def draw_prop(
    picture: NDArray[np.float32], prop: Prop, stand: Stand, unit: BodyFrame
) -> NDArray[np.float32]:
    """
    Draw a thing into a picture.

    :param picture: (H, W, 3) float32, changed.
    :param unit: where somebody of height 1 would be seen who stood there.
    :returns: (H, W) float32 in 0..1, how much of each pixel it covers.
    """
    rows, columns = prop.alpha.shape
    scale = unit.height / _DETAIL
    ground = unit.center_y + unit.height / 2
    # Pixel (u, v) of the thing: the foot is at (columns / 2, rows).
    shear = -stand.lean * scale
    matrix = np.array(
        [
            [scale, shear, unit.center_x - scale * columns / 2 - shear * rows],
            [0.0, scale, ground - scale * rows],
        ]
    )
    size = (picture.shape[1], picture.shape[0])
    cover = np.clip(cv2.warpAffine(prop.alpha, matrix, size), 0, 1)
    colour = cv2.warpAffine(prop.colour, matrix, size, borderMode=cv2.BORDER_REPLICATE)
    picture += cover[..., None] * (colour - picture)
    return np.asarray(cover, np.float32)


def make_pillar(
    rng: np.random.Generator, x: float, z: float, width: float, height: float = 2.2
) -> Prop:
    """Make a round pillar; sizes in statures."""
    rows, columns = round(height * _DETAIL), max(round(width * _DETAIL), 2)
    across = np.linspace(-1, 1, columns, dtype=np.float32)
    shade = 45 * np.sqrt(np.clip(1 - across**2, 0, 1)) - 25
    colour = np.broadcast_to(muted_colour(rng, (0.05, 0.3), (0.35, 0.6)), (rows, columns, 3))
    grain = 6 * value_noise(rng, (rows, columns), 0.1 * _DETAIL)
    painted = np.clip(colour + (shade[None] + grain)[..., None], 0, 255).astype(np.float32)
    stand = Stand(x, z)
    return Prop(painted, np.ones((rows, columns), np.float32), lambda _: stand)


def make_car(rng: np.random.Generator, x: float, z: float, speed: float) -> Prop:
    """
    Make a car that drives through the picture.

    :param x: where it is half way, in statures.
    :param speed: to the right, in statures per second.
    """
    rows, columns = round(0.85 * _DETAIL), round(2.4 * _DETAIL)
    yy, xx = np.mgrid[:rows, :columns].astype(np.float32)
    u, v = xx / columns, yy / rows
    roof = np.clip((0.30 - np.abs(u - 0.48) + 0.18 * (v - 0.45)) * columns, 0, 1)
    body = np.clip((v - 0.45) * rows, 0, 1) * np.clip((0.88 - v) * rows, 0, 1)
    wheels = np.zeros_like(u)
    for middle in (0.2, 0.8):
        radius = np.hypot((u - middle) * columns, (v - 0.84) * rows)
        wheels = np.maximum(wheels, np.clip(0.15 * rows - radius, 0, 1))
    alpha = np.maximum(np.maximum(roof * (v < 0.5), body), wheels)
    colour = np.empty((rows, columns, 3), np.float32)
    colour[:] = muted_colour(rng, (0.4, 0.8), (0.4, 0.8)) + 25 * (0.6 - v)[..., None]
    glass = (v > 0.06) & (v < 0.42) & (roof > 0.9) & (np.abs(u - 0.48) > 0.015)
    colour[glass] = (90, 80, 70)
    colour[wheels > 0.5] = 35
    colour += 3 * value_noise(rng, (rows, columns), 12)[..., None]
    return Prop(
        np.clip(colour, 0, 255).astype(np.float32),
        alpha.astype(np.float32),
        lambda seconds: Stand(x + speed * seconds, z),
    )


def make_tree(
    rng: np.random.Generator, x: float, z: float, swing: float = 0.12, rate: float = 0.5
) -> Prop:
    """
    Make a tree that swings in the wind.

    :param swing: how far its top goes to either side, over its height.
    :param rate: swings per second, there and back.
    """
    rows, columns = round(1.5 * _DETAIL), round(1.0 * _DETAIL)
    yy, xx = np.mgrid[:rows, :columns].astype(np.float32)
    noise = value_noise(rng, (rows, columns), 0.15 * _DETAIL)
    distance = np.hypot((xx - columns / 2) / (0.42 * columns), (yy - 0.36 * rows) / (0.33 * rows))
    crown = np.clip((1 - distance - 0.12 * noise) * 0.2 * _DETAIL, 0, 1)
    trunk = np.clip(0.035 * _DETAIL - np.abs(xx - columns / 2), 0, 1) * (yy > 0.4 * rows)
    colour = np.empty((rows, columns, 3), np.float32)
    colour[:] = np.array([45, 85, 60]) * rng.uniform(0.7, 1.3)
    colour += 18 * value_noise(rng, (rows, columns), 0.06 * _DETAIL)[..., None]
    bark = (trunk > 0.5) & (crown < 0.5)
    colour[bark] = np.array([50, 65, 80], np.float32)
    start = rng.uniform(0, 2 * math.pi)

    def at(seconds: float) -> Stand:
        # Wind comes in gusts: two swings that are not in step.
        there = math.sin(2 * math.pi * rate * seconds + start)
        gust = math.sin(2 * math.pi * 0.37 * rate * seconds)
        return Stand(x, z, swing * there * (0.7 + 0.3 * gust))

    return Prop(
        np.clip(colour, 0, 255).astype(np.float32),
        np.maximum(crown, trunk).astype(np.float32),
        at,
    )
