# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Blobs of moving pixels, and how much they have the shape of a body.

Blobs are connected components, put together where they are one body.  Their shapes are compared
with small templates, by Tanimoto similarity.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.geometry import Box
from gait_segmentation.images import bounding_box, inner_range, tanimoto

_TRIM_ROWS, _TRIM_COLUMNS = 0.005, 0.02
"""Share of a blob's pixels beyond each end of its box."""

_LEAST_AREA, _MOST_PARTS = 10, 32
"""Least pixels of a component, and number of the largest ones that are looked at."""

_OVERLAP, _DISTANCE = 0.4, 0.25
"""
Share of the narrower part's width that two parts above each other must have in common, and most
that they may be apart, in heights of both together.
"""

_ROWS = 24
"""Height in pixels at which regions are compared with templates."""


@dataclass(frozen=True)
class Blob:
    """
    Moving pixels that hang together.

    ``box`` is the box of those that move now, ``area`` the number of all pixels and ``moving``
    that of those that move now.
    """

    box: Box
    area: int
    moving: int


def find_blobs(
    evidence: NDArray[np.uint8], moving: NDArray[np.uint8]
) -> tuple[list[Blob], NDArray[np.uint8]]:
    """
    Find the blobs of a frame.

    :param evidence: (h, w) uint8, non-zero where something is that is no background.
    :param moving: (h, w) uint8, non-zero where something moves now.
    :returns: the blobs, largest first; and (h, w) uint8, 255 where a blob moves, filled row by
        row between its outermost moving pixels.
    """
    closed = cv2.morphologyEx(evidence, cv2.MORPH_CLOSE, np.ones((5, 3), np.uint8))
    # Labels of 16 bits are three times as fast; 480 x 480 pixels cannot hold more.
    count, labels, stats, _ = cv2.connectedComponentsWithStats(
        closed, connectivity=8, ltype=cv2.CV_16U
    )
    parts = [k for k in range(1, count) if stats[k, cv2.CC_STAT_AREA] >= _LEAST_AREA]
    parts.sort(key=lambda k: -stats[k, cv2.CC_STAT_AREA])
    bodies: list[tuple[list[int], Box]] = []
    for part in parts[:_MOST_PARTS]:
        members, box = [part], Box(*stats[part, :4].tolist())
        # What has grown may now be of one body with what it was not before.
        while near := [body for body in bodies if _belong(body[1], box)]:
            bodies.remove(near[0])
            members, box = members + near[0][0], box.union(near[0][1])
        bodies.append((members, box))
    filled = np.zeros_like(evidence)
    blobs = []
    for members, box in bodies:
        window = box.slices(evidence.shape[1], evidence.shape[0])
        own = np.zeros(count, np.bool_)
        own[members] = True
        body = own[labels[window]] & (evidence[window] != 0)
        moves = body & (moving[window] != 0)
        if not moves.any():
            continue
        between = np.logical_or.accumulate(moves, axis=1)
        between &= np.logical_or.accumulate(moves[:, ::-1], axis=1)[:, ::-1]
        filled[window][between] = 255
        top, bottom = inner_range(between.sum(axis=1), _TRIM_ROWS)
        left, right = inner_range(between.sum(axis=0), _TRIM_COLUMNS)
        box = Box(window[1].start + left, window[0].start + top, right - left, bottom - top)
        area, moved = int(body.sum()), int(moves.sum())
        blobs.append(Blob(box, area, moved))
    return sorted(blobs, key=lambda blob: -blob.area), filled


def _belong(a: Box, b: Box) -> bool:
    """Tell whether two parts lie above each other, as those of one body do."""
    across = min(a.right, b.right) - max(a.x, b.x)
    if across < _OVERLAP * min(a.width, b.width):
        return False
    apart, both = max(a.y, b.y) - min(a.bottom, b.bottom), a.union(b).height
    return apart < _DISTANCE * both


class BodyShapes:
    """Templates of a bank, tight about the body and small."""

    def __init__(self, bank: TemplateBank) -> None:
        """Take every other phase and every other view of a bank."""
        rows = bank.templates.shape[2]
        top, bottom = round(rows * (1 - bank.fill) / 2), round(rows * (1 + bank.fill) / 2)
        chosen = bank.templates[::2, ::2].reshape(-1, *bank.templates.shape[2:])
        # A template is never wider than twice its height.
        shapes = [normalised(template[top:bottom]) for template in chosen]
        self._shapes = np.stack([shape for shape in shapes if shape is not None])

    def likeness(self, shape: NDArray[np.uint8]) -> float:
        """Return the similarity of a normalised shape with the template most like it, 0 to 1."""
        return float(tanimoto(self._shapes, shape).max())


def normalised_mask(mask: NDArray[np.uint8]) -> NDArray[np.uint8] | None:
    """Return what is not zero of a mask, (h, w) uint8 0/255, normalised, None of nothing."""
    x, y, width, height = bounding_box(mask)
    return normalised(mask[y : y + height, x : x + width]) if height else None


def normalised(region: NDArray[np.uint8], aspect: float | None = None) -> NDArray[np.uint8] | None:
    """
    Return a tight region at a size of 24 x 48, its centre of mass in the middle.

    :param region: (h, w) uint8, 255 inside.
    :param aspect: its width over its height, if its pixels are not square.
    :returns: (24, 48) uint8, None of what is wider than that.
    """
    height, width = region.shape
    columns = max(1, round(_ROWS * (width / height if aspect is None else aspect)))
    if columns > 2 * _ROWS:
        return None
    small = np.asarray(cv2.resize(region, (columns, _ROWS), interpolation=cv2.INTER_AREA))
    mass = small.sum(axis=0, dtype=np.float64)
    middle = int(np.rint((mass @ np.arange(columns)) / max(mass.sum(), 1.0)))
    out = np.zeros((_ROWS, 2 * _ROWS), np.uint8)
    left = _ROWS - middle
    first, last = max(left, 0), min(left + columns, 2 * _ROWS)
    out[:, first:last] = small[:, first - left : last - left]
    return out
