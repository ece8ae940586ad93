# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Colours and textures of made-up walkers."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.synthetic.scenery import muted_colour, value_noise

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
