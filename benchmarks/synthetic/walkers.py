# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Made-up people: where they walk, and how they are drawn into a picture."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.synthetic.clothing import Outfit, paint
from gait_segmentation.geometry import BodyFrame, Box
from gait_tools.gait_model import render_parts

STRIDE_LENGTH = 0.83
"""In statures."""


@dataclass(frozen=True)
class Whereabouts:
    """
    Where somebody is, in which direction and with which legs.

    ``x`` (to the right) and ``z`` (away from the camera) in statures, ``azimuth`` in radians (0 to
    the right, pi/2 away), ``phase`` in [0, 1), 0 = contact of the right heel.
    """

    x: float
    z: float
    azimuth: float
    phase: float


@dataclass(frozen=True)
class Walker:
    """
    Somebody who walks straight on at one speed.

    ``x``, ``z`` and ``phase`` hold half way; ``stride_rate`` is in strides per second, and
    ``build`` names figure and kind of clothes.
    """

    x: float
    z: float
    azimuth: float
    stride_rate: float
    phase: float
    build: str
    outfit: Outfit

    def at(self, seconds: float) -> Whereabouts:
        """Return where the walker is at a time after half way of the clip."""
        way = STRIDE_LENGTH * self.stride_rate * seconds
        return Whereabouts(
            self.x + way * math.cos(self.azimuth),
            self.z + way * math.sin(self.azimuth),
            self.azimuth,
            (self.phase + self.stride_rate * seconds) % 1.0,
        )

    def near_phase(self, seconds: float) -> float:
        """Return the phase in [0, 1), 0 = heel contact of the leg nearer to the camera."""
        where = self.at(seconds)
        return (where.phase + (0.0 if math.cos(where.azimuth) >= 0 else 0.5)) % 1.0


def draw_walker(
    picture: NDArray[np.float32],
    walker: Walker,
    body: BodyFrame,
    where: Whereabouts,
    shadow: bool,
) -> NDArray[np.float32]:
    """
    Draw somebody into a picture.

    :param picture: (H, W, 3) float32, changed.
    :param body: where the body stands; its angle is not used.
    :param where: direction and phase to draw; not the place.
    :param shadow: whether to cast a shadow on the ground.
    :returns: (H, W) float32 in 0..1, how much of each pixel the body covers.
    """
    whole_x, whole_y = math.floor(body.center_x), math.floor(body.center_y)
    parts = render_parts(
        where.phase,
        where.azimuth,
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
