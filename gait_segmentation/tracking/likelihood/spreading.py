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
from numpy.typing import NDArray

from gait_segmentation.images import Window
from gait_segmentation.kernels import kernel

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

_LINKS = np.exp(-math.sqrt(2) / _EDGE * np.maximum(np.arange(3 * 255 + 1) - _NOISE, 0)).astype(
    np.float32
)
"""What a change from pixel to pixel leaves of the reach."""

_DOUBT = 0.05
"""Sureness at which half of the evidence is left."""

_PERSON_SHARE = 0.6
"""Evidence for the person over that for the background: a body often ends without an edge."""


@kernel('u1[:,:,::1], f4[:,:,::1], i8, i8, f4[:,::1], f8, f8, f4[:,:,::1]', error_model='numpy')
def _seed(
    lab: NDArray[np.uint8],
    sums: NDArray[np.float32],
    top: int,
    left: int,
    moving: NDArray[np.float32],
    sigma: float,
    shadow_floor: float,
    seeds: NDArray[np.float32],
) -> None:
    """Fill in evidence times sureness, and sureness; the window of ``sums`` begins somewhere."""
    scale, seen = np.float32(1 / (sigma * sigma)), np.float32(_SEEN)
    share, half = np.float32(_MOTION_SHARE / 2), np.float32(0.5)
    zero, one, floor = np.float32(0), np.float32(1), np.float32(shadow_floor)
    same, other, chroma_most = np.float32(_SAME), np.float32(_OTHER), np.float32(_SHADOW)
    for row in range(lab.shape[0]):
        line = sums[top + row].reshape(-1)[4 * left : 4 * (left + lab.shape[1])]
        pixels, moves = lab[row].reshape(-1), moving[row]
        evidence, sureness = seeds[0, row], seeds[1, row]
        for col in range(moves.size):
            motion = moves[col]
            sure = share * abs(motion)
            count = line[4 * col + 3]
            known = count / (count + seen) if count >= one else zero
            count = max(count, one)
            base, light = line[4 * col] / count, np.float32(pixels[3 * col])
            d_light = light - base
            d_a = np.float32(pixels[3 * col + 1]) - line[4 * col + 1] / count
            d_b = np.float32(pixels[3 * col + 2]) - line[4 * col + 2] / count
            chroma = scale * (d_a * d_a + d_b * d_b)
            square = chroma + scale * d_light * d_light
            shadow = (chroma <= chroma_most) & (d_light < zero) & (light > floor * base)
            says = one if (square > other) & (not shadow) else zero
            says = -one if square < same else says
            evidence[col] = half * sure * motion + says * known
            sureness[col] = sure + abs(says) * known


@kernel('u1[:,:,::1], f4[::1], f4[:,::1], f4[:,::1]')
def _links(
    lab: NDArray[np.uint8],
    table: NDArray[np.float32],
    across: NDArray[np.float32],
    down: NDArray[np.float32],
) -> None:
    """Fill in how much of a pixel reaches the next one to the right and below."""
    height, width = across.shape
    changes = np.zeros(width, np.int32)
    for row in range(height):
        here = lab[row].reshape(-1)
        for turn in range(2):
            other = lab[min(row + 1, height - 1)].reshape(-1) if turn else here[3:]
            links = down[row] if turn else across[row]
            count = width if turn else width - 1
            changes[width - 1] = 0
            for col in range(count):
                total = np.int32(0)
                for place in range(3 * col, 3 * col + 3):
                    total += abs(np.int32(here[place]) - np.int32(other[place]))
                changes[col] = total
            for col in range(width):
                links[col] = table[changes[col]]


@kernel('f4[:,::1], f4[:,::1], f4[:,::1], f4[:,::1]', fastmath=True)
def _smooth(
    one: NDArray[np.float32],
    two: NDArray[np.float32],
    across: NDArray[np.float32],
    down: NDArray[np.float32],
) -> None:
    """
    Smooth two images in place: there and back along rows and columns, then back and there.

    Together, and along two rows at a time, since along a row each pixel waits for the last.
    """
    height, width = one.shape
    for turn in range(4):
        forth = turn in (0, 3)
        for row in range(0, height, 2):
            other = min(row + 1, height - 1)
            a, b, c, d = one[row], two[row], one[other], two[other]
            e, f = across[row], across[other]
            if other == row:
                # Else the last row of an odd number would be smoothed twice.
                c, d = a.copy(), b.copy()
            if forth:
                for col in range(1, width):
                    u, v = e[col - 1], f[col - 1]
                    a[col] += u * (a[col - 1] - a[col])
                    b[col] += u * (b[col - 1] - b[col])
                    c[col] += v * (c[col - 1] - c[col])
                    d[col] += v * (d[col - 1] - d[col])
            else:
                for col in range(width - 2, -1, -1):
                    u, v = e[col], f[col]
                    a[col] += u * (a[col + 1] - a[col])
                    b[col] += u * (b[col + 1] - b[col])
                    c[col] += v * (c[col + 1] - c[col])
                    d[col] += v * (d[col + 1] - d[col])
        for step in range(1, height):
            row = step if forth else height - 1 - step
            last = row - 1 if forth else row + 1
            links = down[last if forth else row]
            a, b, c, d = one[row], two[row], one[last], two[last]
            for col in range(width):
                a[col] += links[col] * (c[col] - a[col])
                b[col] += links[col] * (d[col] - b[col])


@kernel('f4[:,:,::1], f4[:,:,::1], i8, i8, u1[:,::1]', error_model='numpy')
def _blend(
    seeds: NDArray[np.float32],
    sums: NDArray[np.float32],
    top: int,
    left: int,
    template: NDArray[np.uint8],
) -> None:
    """Turn evidence times sureness into evidence, where the background is unknown."""
    zero, one, doubt = np.float32(0), np.float32(1), np.float32(_DOUBT)
    share, inside = np.float32(_PERSON_SHARE), np.float32(1 / 255)
    for row in range(seeds.shape[1]):
        evidence, sureness, here = seeds[0, row], seeds[1, row], template[row]
        line = sums[top + row].reshape(-1)[4 * left : 4 * (left + evidence.size)]
        for col in range(evidence.size):
            value = evidence[col] / (sureness[col] + doubt)
            likely = inside * np.float32(here[col])
            value *= share * likely if value > zero else one - likely
            evidence[col] = value * max(one - line[4 * col + 3], zero)


def spread_evidence(
    lab: NDArray[np.uint8],
    sums: NDArray[np.float32],
    window: Window,
    sigma: float,
    moving: NDArray[np.float32],
    template: NDArray[np.uint8],
    height: float,
    shadow_floor: float,
) -> NDArray[np.float32]:
    """
    Return evidence (-1..1) for the person where the background was never seen, 0 elsewhere.

    :param lab: (h, w, 3) uint8, a window of the frame.
    :param sums: (H, W, 4) float32 of the background, see :class:`BackgroundModel`.
    :param window: the rows and columns of it that are looked at.
    :param sigma: spread of a pixel of the background in grey levels.
    :param moving: (h, w) float32 in -2..2, evidence that pixels move with the body rather than
        stay.
    :param template: (h, w) uint8, the last template: only there anything speaks for the person,
        and only elsewhere against, since clothes may be as even as the floor and of its colour.
    :param height: of the body in pixels.
    :param shadow_floor: darkest shadow, as a share of the lightness.
    """
    shape = lab.shape[:2]
    top, left = window[0].start, window[1].start
    seeds = np.empty((2, *shape), np.float32)
    _seed(lab, sums, top, left, moving, sigma, shadow_floor, seeds)
    table = _LINKS * np.float32(math.exp(-math.sqrt(2) / (_REACH * height)))
    across, down = np.empty(shape, np.float32), np.empty(shape, np.float32)
    _links(cv2.GaussianBlur(lab, (3, 3), 0), table, across, down)
    _smooth(seeds[0], seeds[1], across, down)
    _blend(seeds, sums, top, left, template)
    return seeds[0]
