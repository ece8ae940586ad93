# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The search for somebody new beside a person who is tracked.

What is large, is not the known background, moves, and stands apart from the person is somebody
else, unless it may be another part of the person.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import Window
from gait_segmentation.tracking.outline import Outline, doubled, halved, lab_of
from gait_segmentation.tracking.person.appearance import Appearance, colour_signature
from gait_segmentation.tracking.person.person import Person
from gait_segmentation.tracking.strangers.beside import Beside

__all__ = ['APART', 'Neighbour', 'newcomers']

_LEAST_HEIGHT, _LEAST_AREA = 0.35, 0.015
"""Height and area of what is somebody else, in body heights of the person near."""

APART, _ASIDE = 0.08, 0.25
"""
Distance of all of it from the template, and of its middle from the person's axis, in body heights:
an arm or a bag that was missed is nearer.
"""

_GAP = 0.04
"""Least gap to a tracked person and what is about the template, in body heights."""

_MOVING = 0.2
"""Least share that must move: what only differs is grass, or stands nearer than the background."""

_ALIKE = 0.5
"""Similarity of colours from which something may be the tracked person."""

_BRIDGED = 0.02
"""Gaps up to this, in body heights, do not part what is somebody else."""


@dataclass(frozen=True)
class Neighbour:
    """
    A tracked person about whom somebody new is sought.

    ``window`` are the rows and columns about the person in the working image.  If not as much as
    usual of the person is seen (``whole``) what touches or looks like the person may be another
    part, as beyond a pole; if the person is not ``inside`` of the image what touches may be.
    """

    person: Person
    appearance: Appearance
    window: Window
    whole: bool
    inside: bool


def newcomers(
    beside: Beside, neighbour: Neighbour, known: Sequence[tuple[Outline, float]]
) -> list[Outline]:
    """
    Return who is new beside a person.

    :param known: outlines that belong to somebody known already, and the margins in pixels of half
        the size up to which what is about them does, too.
    """
    person = neighbour.person
    window = halved(neighbour.window)
    # From here on all is in pixels of half the size.
    height = person.height / 2
    if window[0].start >= window[0].stop or window[1].start >= window[1].stop:
        return []
    others = cv2.bitwise_not(beside.people[window])
    strange = np.asarray(cv2.bitwise_and(beside.strange[window], others))
    moving = beside.moving[window]
    if not _enough(strange, moving, height):
        return []
    sure = neighbour.whole and neighbour.inside
    if sure:
        strange &= beside.far(window, APART * height)
    for outline, margin in known:
        strange[_grown(outline.seen_in(window), margin) > 0] = 0
    if not _enough(strange, moving, height):
        return []
    size = max(1, round(_BRIDGED * height))
    strange = cv2.morphologyEx(strange, cv2.MORPH_CLOSE, _square(size))
    strange = cv2.morphologyEx(strange, cv2.MORPH_OPEN, np.ones((2, 2), np.uint8))
    count, parts, stats, centers = cv2.connectedComponentsWithStats(strange, connectivity=4)
    axis = person.center_x / 2 - window[1].start
    found: list[tuple[slice, NDArray[np.bool_]]] = []
    for number in range(1, count):
        left, _, width, tall, area = stats[number]
        if (
            tall < _LEAST_HEIGHT * height
            or area < _LEAST_AREA * height**2
            or abs(centers[number][0] - axis) < _ASIDE * height
        ):
            continue
        part = parts == number
        if np.count_nonzero(moving[part]) < _MOVING * area:
            continue
        if not sure and _touches(beside, window, part, height):
            continue
        if not neighbour.whole and _alike(beside, neighbour, window, part):
            continue
        for columns, other in found:
            if left < columns.stop and left + width > columns.start:
                # Parts above each other are of one person.
                other |= part
                break
        else:
            found.append((slice(left, left + width), part))
    top, first = window[0].start, window[1].start
    return [Outline.of(255 * part.view(np.uint8), top, first) for _, part in found]


def _enough(strange: NDArray[np.uint8], moving: NDArray[np.uint8], height: float) -> bool:
    """Return whether enough is strange, and moves in enough rows, to be somebody."""
    if cv2.countNonZero(strange) < _LEAST_AREA * height**2:
        return False
    rows = cv2.reduce(cv2.bitwise_and(strange, moving), 1, cv2.REDUCE_MAX)
    return cv2.countNonZero(rows) >= _LEAST_HEIGHT * height


def _touches(beside: Beside, window: Window, part: NDArray[np.bool_], height: float) -> bool:
    """Return whether something is so near a person that it may be what is seen of the rest."""
    near = cv2.bitwise_not(beside.far(window, APART * height))
    taken = cv2.bitwise_or(beside.people[window], near)
    return bool(_grown(np.asarray(taken), _GAP * height)[part].any())


def _alike(beside: Beside, neighbour: Neighbour, window: Window, part: NDArray[np.bool_]) -> bool:
    """Return whether something looks like the person, as beyond a pole it would."""
    lab = lab_of(beside.record.image, window)
    rows = np.ascontiguousarray(neighbour.person.rows(doubled(window))[::2, ::2])
    inside = np.uint8(255) * part.view(np.uint8)
    signature = colour_signature(lab, inside, rows)
    return neighbour.appearance.similarity(signature) >= _ALIKE


def _grown(mask: NDArray[np.uint8], margin: float) -> NDArray[np.uint8]:
    """Return a mask with a margin in pixels."""
    return np.asarray(cv2.dilate(mask, _square(max(1, round(margin)))))


def _square(margin: int) -> NDArray[np.uint8]:
    return np.ones((2 * margin + 1, 2 * margin + 1), np.uint8)
