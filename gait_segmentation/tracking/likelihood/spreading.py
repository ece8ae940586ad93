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
from gait_segmentation.tracking.background.kernels import LIMIT
from gait_segmentation.tracking.background.model import BackgroundModel
from gait_segmentation.tracking.competition import REACH

__all__ = ['spread_evidence']

_EDGE = 10.0
"""Change of Lab from pixel to pixel that divides the reach by e^1.4."""

_DOUBT = 0.05
"""Sureness at which half of the evidence is left."""

_PERSON_SHARE = 0.6
"""Evidence for the person over that for the background: a body often ends without an edge."""


def _links(
    lab: NDArray[np.uint8], reach: float
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """
    Return how much of a pixel reaches the next one to the right and below.

    :param reach: in an even area, in pixels.
    """
    smooth = cv2.GaussianBlur(lab, (3, 3), 0)
    out = []
    for to_x, to_y in ((1, 0), (0, 1)):
        moved = cv2.copyMakeBorder(smooth, 0, to_y, 0, to_x, cv2.BORDER_REPLICATE)[to_y:, to_x:]
        change = cv2.absdiff(smooth, moved).astype(np.float32)
        change = cv2.transform(change, np.ones((1, 3), np.float32))
        fall = change / _EDGE + 1 / reach
        out.append(np.exp(np.float32(-math.sqrt(2)) * fall))
    return out[0], out[1]


@kernel('f4[:,::1], f4[:,::1], f4[:,::1], f4[:,::1]', fastmath=True)
def _smooth(
    one: NDArray[np.float32],
    two: NDArray[np.float32],
    across: NDArray[np.float32],
    down: NDArray[np.float32],
) -> None:
    """Smooth two images in place: there and back along rows and columns, then back and there."""
    height, width = one.shape
    for turn in range(4):
        forth = turn in (0, 3)
        for row in range(height):
            a, b, links = one[row], two[row], across[row]
            for step in range(1, width):
                col = step if forth else width - 1 - step
                last = col - 1 if forth else col + 1
                link = links[last if forth else col]
                a[col] += link * (a[last] - a[col])
                b[col] += link * (b[last] - b[col])
        for step in range(1, height):
            row = step if forth else height - 1 - step
            last = row - 1 if forth else row + 1
            links = down[last if forth else row]
            a, b, c, d = one[row], two[row], one[last], two[last]
            for col in range(width):
                a[col] += links[col] * (c[col] - a[col])
                b[col] += links[col] * (d[col] - b[col])


def spread_evidence(
    lab: NDArray[np.uint8],
    background: BackgroundModel,
    window: Window,
    moving: NDArray[np.float32],
    template: NDArray[np.uint8],
    height: float,
    shadow_floor: float,
) -> NDArray[np.float32]:
    """
    Return evidence (-1..1) for the person where the background was never seen, 0 elsewhere.

    :param lab: (h, w, 3) uint8, a window of the frame.
    :param window: its rows and columns.
    :param moving: (h, w) float32 in -2..2, evidence that pixels move with the body rather than
        stay.
    :param template: (h, w) uint8, the last template: only there anything speaks for the person,
        and only elsewhere against, since clothes may be as even as the floor and of its colour.
    :param height: of the body in pixels.
    :param shadow_floor: darkest shadow, as a share of the lightness.
    """
    known = background.evidence(lab, window, shadow_floor) / np.float32(LIMIT)
    sure = np.abs(moving) / 2
    evidence, sureness = sure * moving / 2 + known, sure + np.abs(known)
    _smooth(evidence, sureness, *_links(lab, REACH * height))
    value = evidence / (sureness + np.float32(_DOUBT))
    likely = template * np.float32(1 / 255)
    value *= np.where(value > 0, np.float32(_PERSON_SHARE) * likely, 1 - likely)
    return value * np.maximum(1 - background.count[window], 0)
