# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
What is known of some pixels, spread over even areas to those whose background was never seen.

Of a person just started nothing is known of what is behind, and the colours come from one
doubtful mask: a piece of wall in it trails behind the person as a ghost, and a leg missed is
missed again.  But about it there are pixels that look like the remembered background, or do not,
or that are seen to move with the body.  An even area without edges is one thing, so what is known
at its rim holds for all of it.

Evidence and how sure it is are smoothed by the same recursive filter, whose reach ends at edges
(the domain transform of Gastal and Oliveira, SIGGRAPH 2011), and divided.
"""

from __future__ import annotations

import math

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ['spread_evidence']

_SAME, _OTHER = 6.0, 16.0
"""Squared distance from the background, in ``sigma``, up to and from which it is told."""

_SHADOW = 9.0
"""Squared distance of the chroma, in ``sigma``, up to which something darker is a shadow."""

_SEEN = 0.5
_MOTION_SHARE = 0.7
"""How sure the motion cue is against a background that is known well."""

_REACH = 0.12
"""How far evidence reaches in an even area, in body heights."""

_NOISE, _EDGE = 1.0, 10.0
"""Change of Lab from pixel to pixel that is none, and that divides the reach by e^1.4."""

_DOUBT = 0.05
"""Sureness at which half of the evidence is left."""

_PERSON_SHARE = 0.6
"""Evidence for the person over that for the background: a body often ends without an edge."""


@njit(cache=True, nogil=True)
def _seed(
    lab: NDArray[np.uint8],
    sums: NDArray[np.float32],
    moving: NDArray[np.float32],
    sigma: float,
    shadow_floor: float,
    evidence: NDArray[np.float32],
    sureness: NDArray[np.float32],
) -> None:
    scale, seen = np.float32(1 / (sigma * sigma)), np.float32(_SEEN)
    share = np.float32(_MOTION_SHARE / 2)
    for row in range(lab.shape[0]):
        for col in range(lab.shape[1]):
            motion = moving[row, col]
            sure = share * abs(motion)
            value = sure * motion / 2
            count = sums[row, col, 3]
            if count >= 1:
                base = sums[row, col, 0] / count
                light = np.float32(lab[row, col, 0])
                d_light = light - base
                d_a = np.float32(lab[row, col, 1]) - sums[row, col, 1] / count
                d_b = np.float32(lab[row, col, 2]) - sums[row, col, 2] / count
                chroma = scale * (d_a * d_a + d_b * d_b)
                square = chroma + scale * d_light * d_light
                shadow = chroma <= _SHADOW and d_light < 0 and light > shadow_floor * base
                known = count / (count + seen)
                if square < _SAME:
                    value -= known
                    sure += known
                elif square > _OTHER and not shadow:
                    value += known
                    sure += known
            evidence[row, col] = value
            sureness[row, col] = sure


@njit(cache=True, nogil=True)
def _links(
    lab: NDArray[np.uint8],
    table: NDArray[np.float32],
    across: NDArray[np.float32],
    down: NDArray[np.float32],
) -> None:
    """Fill in how much of a pixel reaches the next one to the right and below."""
    height, width = across.shape
    for row in range(height):
        for col in range(width):
            right, below = 0, 0
            for channel in range(3):
                value = np.int32(lab[row, col, channel])
                if col + 1 < width:
                    right += abs(value - np.int32(lab[row, col + 1, channel]))
                if row + 1 < height:
                    below += abs(value - np.int32(lab[row + 1, col, channel]))
            across[row, col], down[row, col] = table[right], table[below]


@njit(cache=True, nogil=True, fastmath=True)
def _smooth(
    image: NDArray[np.float32], across: NDArray[np.float32], down: NDArray[np.float32]
) -> None:
    """Smooth in place: there and back along rows and columns, then back and there."""
    height, width = image.shape
    for turn in range(4):
        if turn in (0, 3):
            for row in range(height):
                for col in range(1, width):
                    change = image[row, col - 1] - image[row, col]
                    image[row, col] += across[row, col - 1] * change
            for row in range(1, height):
                for col in range(width):
                    change = image[row - 1, col] - image[row, col]
                    image[row, col] += down[row - 1, col] * change
        else:
            for row in range(height):
                for col in range(width - 2, -1, -1):
                    image[row, col] += across[row, col] * (image[row, col + 1] - image[row, col])
            for row in range(height - 2, -1, -1):
                for col in range(width):
                    image[row, col] += down[row, col] * (image[row + 1, col] - image[row, col])


@njit(cache=True, nogil=True)
def _blend(
    evidence: NDArray[np.float32],
    sureness: NDArray[np.float32],
    sums: NDArray[np.float32],
    template: NDArray[np.uint8],
) -> None:
    """Turn evidence times sureness into evidence, where the background is unknown."""
    one, doubt = np.float32(1), np.float32(_DOUBT)
    share, inside = np.float32(_PERSON_SHARE), np.float32(1 / 255)
    for row in range(evidence.shape[0]):
        for col in range(evidence.shape[1]):
            value = evidence[row, col] / (sureness[row, col] + doubt)
            likely = inside * np.float32(template[row, col])
            value *= share * likely if value > 0 else one - likely
            evidence[row, col] = value * max(one - sums[row, col, 3], np.float32(0))


def spread_evidence(
    lab: NDArray[np.uint8],
    sums: NDArray[np.float32],
    sigma: float,
    moving: NDArray[np.float32],
    template: NDArray[np.uint8],
    height: float,
    shadow_floor: float,
) -> NDArray[np.float32]:
    """
    Return evidence (-1..1) for the person where the background was never seen, 0 elsewhere.

    :param lab: (h, w, 3) uint8, a window of the frame.
    :param sums: (h, w, 4) float32 of the background there, see :class:`BackgroundModel`.
    :param sigma: spread of a pixel of the background in grey levels.
    :param moving: (h, w) float32 in -2..2, evidence that pixels move with the body rather than
        stay.
    :param template: (h, w) uint8, the last template: only there anything speaks for the person,
        and only elsewhere against, since clothes may be as even as the floor and of its colour.
    :param height: of the body in pixels.
    :param shadow_floor: darkest shadow, as a share of the lightness.
    """
    shape = lab.shape[:2]
    evidence, sureness = np.empty(shape, np.float32), np.empty(shape, np.float32)
    _seed(lab, sums, moving, sigma, shadow_floor, evidence, sureness)
    change = np.maximum(np.arange(3 * 255 + 1) - _NOISE, 0) / _EDGE
    table = np.exp(-math.sqrt(2) * (change + 1 / (_REACH * height))).astype(np.float32)
    across, down = np.empty(shape, np.float32), np.empty(shape, np.float32)
    _links(cv2.GaussianBlur(lab, (3, 3), 0), table, across, down)
    for image in (evidence, sureness):
        _smooth(image, across, down)
    _blend(evidence, sureness, sums, template)
    return evidence
