# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Made-up places for made-up walkers: a wide picture of a wall, ground and clutter."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

FloatImage = NDArray[np.float32]


def muted_colour(
    rng: np.random.Generator,
    saturation: tuple[float, float] = (0.05, 0.45),
    value: tuple[float, float] = (0.25, 0.8),
) -> NDArray[np.float32]:
    """Draw a (3,) float32 BGR colour, 0..255, of limited saturation and brightness."""
    hsv = np.array([[[rng.uniform(0, 360), rng.uniform(*saturation), rng.uniform(*value)]]])
    return np.asarray(cv2.cvtColor(hsv.astype(np.float32), cv2.COLOR_HSV2BGR)[0, 0] * 255)


def value_noise(
    rng: np.random.Generator, shape: tuple[int, int], coarse: float, stretch: float = 1.0
) -> FloatImage:
    """
    Make smooth noise with detail at every size, as stone, foliage and cloth have it.

    :param shape: (H, W).
    :param coarse: size of the largest spots in pixels; each finer one has half size and weight.
    :param stretch: width of the spots over their height.
    :returns: (H, W) float32 of mean 0 and standard deviation 1.
    """
    height, width = shape
    total = np.zeros(shape, np.float32)
    weight, spot = 1.0, coarse
    while spot >= 1.5:
        cells = (max(round(height / spot), 1) + 1, max(round(width / (spot * stretch)), 1) + 1)
        grid = rng.standard_normal(cells, dtype=np.float32)
        total += weight * cv2.resize(grid, (width, height), interpolation=cv2.INTER_CUBIC)
        weight, spot = 0.6 * weight, spot / 2
    total -= total.mean()
    return total / max(float(total.std()), 1e-6)


def _fill(
    picture: FloatImage, shape: FloatImage, colour: NDArray[np.float32], texture: FloatImage
) -> None:
    """Paint (H, W) coverage with a colour and a texture added to all channels."""
    alpha = shape[..., None]
    picture *= 1 - alpha
    picture += alpha * (colour + texture[..., None])


def _rectangle(picture: FloatImage, rng: np.random.Generator, ground: int, unit: float) -> None:
    """Add a door, window, poster or crate: a framed rectangle."""
    width, height = unit * rng.uniform(0.15, 0.8), unit * rng.uniform(0.15, 1.1)
    left = rng.uniform(-width, picture.shape[1])
    standing = rng.random() < 0.5
    bottom = ground + unit * rng.uniform(0, 0.1) if standing else rng.uniform(0, ground)
    rows = slice(max(round(bottom - height), 0), max(round(bottom), 0))
    columns = slice(max(round(left), 0), max(round(left + width), 0))
    part = picture[rows, columns]
    if part.shape[0] < 4 or part.shape[1] < 4:
        return
    frame = max(round(0.02 * unit), 1)
    part *= 0.6
    inner = part[frame:-frame, frame:-frame]
    if inner.shape[0] < 2 or inner.shape[1] < 2:
        return
    slope = np.linspace(-1, 1, inner.shape[0], dtype=np.float32)[:, None] * rng.uniform(-12, 12)
    grain = value_noise(rng, inner.shape[:2], 0.2 * unit) * rng.uniform(2, 9)
    inner[:] = muted_colour(rng, (0.03, 0.35)) + (slope + grain)[..., None]


def _bush(picture: FloatImage, rng: np.random.Generator, ground: int, unit: float) -> None:
    """Add foliage: a ragged ellipse with rough light and shade."""
    radius_x, radius_y = unit * rng.uniform(0.15, 0.5), unit * rng.uniform(0.12, 0.45)
    x = rng.uniform(0, picture.shape[1])
    # Shrubs stand on the ground, crowns of trees hang in from above.
    y = ground - 0.6 * radius_y if rng.random() < 0.8 else rng.uniform(-0.1, 0.1) * ground
    yy, xx = np.mgrid[: picture.shape[0], : picture.shape[1]].astype(np.float32)
    noise = value_noise(rng, picture.shape[:2], 0.12 * unit)
    distance = np.hypot((xx - x) / radius_x, (yy - y) / radius_y) + 0.14 * noise
    shape = np.clip((1 - distance) * 0.15 * unit, 0, 1)
    green = np.array([45, 80, 60], np.float32) * rng.uniform(0.6, 1.3)
    green += rng.uniform(-15, 15, 3).astype(np.float32)
    leaves = value_noise(rng, picture.shape[:2], 0.05 * unit)
    _fill(picture, shape, green, 16 * leaves - 10 * (yy - y) / radius_y)


def _pole(picture: FloatImage, rng: np.random.Generator, ground: int, unit: float) -> None:
    """Add a lamp post or tree trunk, rounded by its shading."""
    width = max(round(unit * rng.uniform(0.03, 0.12)), 2)
    left = int(rng.integers(0, max(picture.shape[1] - width, 1)))
    bottom = min(round(ground + unit * rng.uniform(0, 0.15)), picture.shape[0])
    across = np.linspace(-1, 1, width, dtype=np.float32)
    shade = 18 * np.sqrt(np.maximum(1 - across**2, 0)) - 14
    grain = value_noise(rng, (bottom, width), 0.05 * unit) * 6
    colour = muted_colour(rng, (0.05, 0.3), (0.2, 0.6))
    picture[:bottom, left : left + width] = colour + (shade[None] + grain)[..., None]


def make_panorama(
    rng: np.random.Generator, shape: tuple[int, int], ground: int, unit: float, clutter: float
) -> NDArray[np.uint8]:
    """
    Paint a wall, the ground before it, and things standing about.

    :param shape: (H, W) of the picture.
    :param ground: row where the ground begins.
    :param unit: height of a person there, in pixels.
    :param clutter: 0 an empty wall, 1 crowded.
    :returns: (H, W, 3) uint8 BGR.
    """
    height, width = shape
    ground = min(max(ground, 0), height)
    light = np.linspace(8, -8, height, dtype=np.float32)[:, None, None]
    picture = np.empty((height, width, 3), np.float32)
    picture[:] = muted_colour(rng, (0.02, 0.14), (0.45, 0.75)) + light
    picture += 5 * value_noise(rng, shape, 1.2 * unit)[..., None]
    picture += 2.5 * value_noise(rng, shape, 4)[..., None]
    things = round(12 * clutter * width / (3 * unit))
    kinds = (_rectangle, _rectangle, _rectangle, _bush, _pole)
    for kind in rng.integers(len(kinds), size=things):
        kinds[kind](picture, rng, ground, unit)
    if ground < height:
        floor = (height - ground, width)
        picture[ground:] = muted_colour(rng, (0.02, 0.14), (0.3, 0.65))
        picture[ground:] += 9 * value_noise(rng, floor, 0.25 * unit, 4.0)[..., None]
        picture[ground:] += 4 * value_noise(rng, floor, 4, 2.0)[..., None]
        # Where wall and ground meet it is darker.
        rows = np.arange(height - ground, dtype=np.float32)
        picture[ground:] *= (1 - 0.25 * np.exp(-rows / (0.06 * unit)))[:, None, None]
    return np.asarray(np.clip(picture, 0, 255).astype(np.uint8))
