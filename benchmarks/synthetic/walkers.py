# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Made-up people: what they wear, where they walk, and how they are drawn into a picture."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.synthetic.scenery import muted_colour, value_noise
from gait_segmentation.geometry import BodyFrame, Box
from gait_tools.gait_model import render_parts

STRIDE_LENGTH = 0.83
"""In statures."""

SKINS = ((175, 200, 235), (140, 170, 215), (95, 130, 180), (60, 85, 125))
HAIRS = ((25, 25, 30), (35, 50, 75), (60, 95, 130), (120, 125, 130))

_HAIR_SHARE = 0.45
"""Upper share of the head that is hair."""

_TEXTURE = 128
"""Side of the texture, which is stretched over the body."""


@dataclass(frozen=True)
class Outfit:
    """
    What somebody looks like.

    ``colours`` maps body parts to (3,) float32 BGR, ``hair`` is one such colour; ``textures``
    maps the dressed parts to (n, n) float32, added to their brightness.
    """

    colours: dict[str, NDArray[np.float32]]
    hair: NDArray[np.float32]
    textures: dict[str, NDArray[np.float32]]


def make_outfit(rng: np.random.Generator, build: str = 'average') -> Outfit:
    """
    Draw clothes, skin and hair: cloth of moderate colours, melange or striped.

    :param build: name of the walker's build; under a dress legs are bare.
    """
    skin = np.array(SKINS[rng.integers(len(SKINS))], np.float32)
    top = muted_colour(rng, (0.1, 0.65), (0.2, 0.8))
    bottom = muted_colour(rng, (0.05, 0.5), (0.15, 0.55))
    plain = 4 * value_noise(rng, (_TEXTURE, _TEXTURE), 24)
    pattern = plain
    if rng.random() < 0.3:
        rows = np.arange(_TEXTURE, dtype=np.float32)[:, None]
        stripes = 14 * np.sign(np.sin(rows * 2 * np.pi / rng.uniform(5, 10)))
        pattern = (plain + stripes).astype(np.float32)
    colours = {
        'head': skin,
        'torso': top,
        'skirt': top,
        'rucksack': muted_colour(rng, (0.2, 0.7), (0.2, 0.6)),
        'arms': top if rng.random() < 0.8 else skin,
        'hands': skin,
        'legs': skin if build == 'dress' else bottom,
        'feet': muted_colour(rng, (0.0, 0.3), (0.1, 0.5)),
    }
    hair = np.array(HAIRS[rng.integers(len(HAIRS))], np.float32)
    textures = {
        name: pattern if colours[name] is top else plain
        for name in colours
        if colours[name] is not skin
    }
    return Outfit(colours, hair, textures)


def paint(parts: dict[str, NDArray[np.uint8]], outfit: Outfit) -> NDArray[np.float32]:
    """
    Paint the parts of a body.

    :param parts: part -> (h, w) uint8 alpha, adding up to the silhouette.
    :returns: (h, w, 3) float32 BGR, 0..255, continued a little beyond the silhouette.
    """
    alphas = {name: np.float32(1 / 255) * alpha for name, alpha in parts.items()}
    _pull_down(alphas)
    coverage = np.sum(list(alphas.values()), axis=0)
    height, width = coverage.shape
    total = np.zeros((height, width, 3), np.float32)
    for name, alpha in alphas.items():
        # Light comes from above and the front, so that every part is round.
        soft = max(0.02 * height, 0.6)
        thickness = cv2.GaussianBlur(alpha, (0, 0), soft)
        shade = 30 * (thickness - 0.7)
        if name in outfit.textures:
            shade = shade + cv2.resize(outfit.textures[name], (width, height))
        total += alpha[..., None] * (outfit.colours[name] + shade[..., None])
        if name == 'head':
            total += _hair(alpha) * (outfit.hair - outfit.colours[name])
    # Colours of the rim come from what is next to it, not from black.
    weight = coverage[..., None] + 1e-3 * cv2.GaussianBlur(coverage, (0, 0), 2)[..., None]
    spread = total + 1e-3 * cv2.GaussianBlur(total, (0, 0), 2)
    return np.asarray(np.clip(spread / np.maximum(weight, 1e-6), 0, 255), np.float32)


def _pull_down(alphas: dict[str, NDArray[np.float32]]) -> None:
    """Let a skirt or coat hide the legs down to its hem, also the leg that swings forward."""
    hem = np.flatnonzero(alphas['skirt'].max(axis=1) > 0.5)
    if hem.size > 0:
        alphas['skirt'][: hem[-1]] += alphas['legs'][: hem[-1]]
        alphas['legs'][: hem[-1]] = 0


def _hair(head: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return (h, w, 1) coverage by hair: the top of the head."""
    rows = np.flatnonzero(head.max(axis=1) > 0.5)
    if rows.size == 0:
        return np.zeros((*head.shape, 1), np.float32)
    edge = rows[0] + _HAIR_SHARE * rows.size
    share = np.clip(edge - np.arange(len(head), dtype=np.float32), 0, 1)
    return np.asarray((head * share[:, None])[..., None])


@dataclass(frozen=True)
class Walker:
    """
    Somebody who walks straight on at one speed.

    ``x`` (to the right) and ``z`` (away from the camera) in statures and ``phase`` in [0, 1),
    0 = contact of the right heel, hold half way.  ``azimuth`` is in radians, 0 to the right and
    pi/2 away, ``stride_rate`` in strides per second; ``build`` names figure and kind of clothes.
    """

    x: float
    z: float
    azimuth: float
    stride_rate: float
    phase: float
    build: str
    outfit: Outfit

    def place_at(self, seconds: float) -> tuple[float, float]:
        """Return x and z at a time after half way of the clip."""
        way = STRIDE_LENGTH * self.stride_rate * seconds
        return self.x + way * math.cos(self.azimuth), self.z + way * math.sin(self.azimuth)

    def phase_at(self, seconds: float) -> float:
        """Return the phase then."""
        return (self.phase + self.stride_rate * seconds) % 1.0

    def near_phase_at(self, seconds: float) -> float:
        """Return the phase in [0, 1), 0 = heel contact of the leg nearer to the camera."""
        return (self.phase_at(seconds) + (0.0 if math.cos(self.azimuth) >= 0 else 0.5)) % 1.0


def draw_walker(
    picture: NDArray[np.float32], walker: Walker, body: BodyFrame, phase: float, shadow: bool
) -> NDArray[np.float32]:
    """
    Draw somebody into a picture.

    :param picture: (H, W, 3) float32, changed.
    :param body: where the body stands; its angle is not used.
    :param shadow: whether to cast a shadow on the ground.
    :returns: (H, W) float32 in 0..1, how much of each pixel the body covers.
    """
    whole_x, whole_y = math.floor(body.center_x), math.floor(body.center_y)
    parts = render_parts(
        phase,
        walker.azimuth,
        body.height,
        build=walker.build,
        shift=(body.center_x - whole_x, body.center_y - whole_y),
    )
    cover = np.minimum(np.sum(list(parts.values()), axis=0, dtype=np.float32) / 255, 1)
    rows, columns = cover.shape
    left, top = whole_x - columns // 2, whole_y - rows // 2
    if shadow:
        _cast_shadow(picture, cover, (left, top), body)
    height, width = picture.shape[:2]
    result = np.zeros((height, width), np.float32)
    box = Box(left, top, columns, rows).clipped(width, height)
    if box is None:
        return result
    there = box.slices(width, height)
    here = (
        slice(there[0].start - top, there[0].stop - top),
        slice(there[1].start - left, there[1].stop - left),
    )
    colour = paint(parts, walker.outfit)
    picture[there] += cover[here][..., None] * (colour[here] - picture[there])
    result[there] = cover[here]
    return result


def _cast_shadow(
    picture: NDArray[np.float32],
    cover: NDArray[np.float32],
    corner: tuple[int, int],
    body: BodyFrame,
) -> None:
    """
    Darken the ground behind somebody by the silhouette, sheared, flattened and blurred.

    :param picture: (H, W, 3) float32, changed.
    :param cover: (h, w) float32 silhouette.
    :param corner: x and y of the silhouette's top left pixel in the picture.
    """
    left, top = corner
    ground = body.center_y + body.height / 2
    # A point z above the ground falls on (x + lean z, ground - flat z).
    lean, flat = 0.6, 0.15
    matrix = np.array(
        [[1, -lean, left + lean * (ground - top)], [0, flat, ground - flat * (ground - top)]]
    )
    size = (picture.shape[1], picture.shape[0])
    shadow = cv2.warpAffine(cover, matrix, size, flags=cv2.INTER_LINEAR)
    picture *= 1 - 0.4 * cv2.GaussianBlur(shadow, (0, 0), 0.015 * body.height)[..., None]
