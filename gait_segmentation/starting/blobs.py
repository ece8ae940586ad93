# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Blobs of moving pixels, and how much they have the shape of a body.

Blobs are connected components, put together where they are one body.  Their shapes are compared
with small templates, by Tanimoto similarity.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.geometry import Box
from gait_segmentation.images import tanimoto
from gait_segmentation.kernels import kernel

_TRIM_ROWS, _TRIM_COLUMNS = 0.005, 0.02
_LEAST_AREA = 10
_MOST_PARTS = 48
_OVERLAP, _DISTANCE = 0.4, 0.25
"""
Share of the narrower part's width that two parts above each other must have in common, and most
that they may be apart, in heights of both together.
"""

_LEAST_BODY, _LEAST_ASPECT, _MOST_ASPECT = 14, 1.5, 5.0
"""Height in pixels, and height over width, of parts that may be whole bodies."""

_CROWD, _SMALL = 4, 0.4
"""
Number of such parts from which they are taken for several people rather than for pieces of one,
and the height of a piece, as a share of that of what it is put to.
"""

_HEADS_FROM, _TWO_FROM = 36, 0.5
"""Height in pixels from which heads can be told, and width over height from which of two."""

_HIGH, _DEEP, _APART = 0.25, 0.18, 0.3
"""
How low a head may be below the highest one, how deep the gap between two, and how far apart they
are at least, in heights.
"""

_ROWS = 24
"""Height in pixels at which regions are compared with templates."""


@dataclass(frozen=True)
class Blob:
    """
    Moving pixels that hang together.

    ``box`` is the box of those that move now, ``area`` the number of all pixels and ``moving``
    that of those that move now.  ``number`` tells it from the others of the frame.
    """

    box: Box
    area: int
    moving: int
    number: int = 0


def find_blobs(
    evidence: NDArray[np.uint8], moving: NDArray[np.uint8]
) -> tuple[list[Blob], NDArray[np.uint8]]:
    """
    Find the blobs of a frame.  People who touch are a blob each if their heads are apart.

    :param evidence: (h, w) uint8, non-zero where something is that is no background.
    :param moving: (h, w) uint8, non-zero where something moves now.
    :returns: the blobs, largest first; and (h, w) uint8, 255 where a blob moves, filled row by
        row between its outermost moving pixels.
    """
    size = evidence.shape[1], evidence.shape[0]
    closed = cv2.morphologyEx(evidence, cv2.MORPH_CLOSE, np.ones((5, 3), np.uint8))
    # Labels of 16 bits are three times as fast; 480 x 480 pixels cannot hold more.
    count, labels, stats, _ = cv2.connectedComponentsWithStats(
        closed, connectivity=8, ltype=cv2.CV_16U
    )
    parts = [k for k in range(1, count) if stats[k, cv2.CC_STAT_AREA] >= _LEAST_AREA]
    parts.sort(key=lambda k: -stats[k, cv2.CC_STAT_AREA])
    parts = parts[:_MOST_PARTS]
    boxes = [Box(*(float(v) for v in stats[k, :4])) for k in parts]
    count = _split(labels, parts, boxes, count)
    table = np.zeros(count, np.int32)
    filled = np.zeros_like(evidence)
    blobs = []
    for number, (members, around) in enumerate(_merged(boxes), start=1):
        for member in members:
            table[parts[member]] = number
        rows, columns, measures = (np.zeros(n, np.int32) for n in (*evidence.shape, 2))
        (up, down), (left, right) = ((part.start, part.stop) for part in around.slices(*size))
        _fill(
            labels, table, evidence, moving, number, (up, down, left, right),
            filled, rows, columns, measures,
        )  # fmt: skip
        area, moved = measures.tolist()
        if moved:
            (up, down), (left, right) = _range(rows, _TRIM_ROWS), _range(columns, _TRIM_COLUMNS)
            blobs.append(Blob(Box(left, up, right - left, down - up), area, moved, number))
    return sorted(blobs, key=lambda blob: -blob.area), filled


def _split(labels: NDArray[np.uint16], parts: list[int], boxes: list[Box], count: int) -> int:
    """
    Give each of several people in one part a label and a box of their own.

    :param labels, parts, boxes: of the parts; changed.
    :param count: number of labels so far.
    :returns: number of labels now.
    """
    for index in range(len(parts)):
        window = boxes[index].slices(labels.shape[1], labels.shape[0])
        people = columns_of_people(labels[window] == parts[index])
        for first, last in people[1:]:
            place = window[0], slice(window[1].start + first, window[1].start + last)
            mine = labels[place] == parts[index]
            labels[place][mine] = count
            parts.append(count)
            boxes.append(_box_of(mine).shifted(place[1].start, place[0].start))
            count += 1
        if len(people) > 1:
            box = _box_of(labels[window] == parts[index])
            boxes[index] = box.shifted(window[1].start, window[0].start)
    return count


def _box_of(part: NDArray[np.bool_]) -> Box:
    rows, columns = np.flatnonzero(part.any(axis=1)), np.flatnonzero(part.any(axis=0))
    height, width = rows[-1] + 1 - rows[0], columns[-1] + 1 - columns[0]
    return Box(float(columns[0]), float(rows[0]), float(width), float(height))


def _range(counts: NDArray[np.int32], trim: float) -> tuple[int, int]:
    """Return from where to where the entries go, without a share at either end."""
    total = np.cumsum(counts)
    first = int(np.searchsorted(total, trim * total[-1], side='right'))
    last = int(np.searchsorted(total, (1 - trim) * total[-1], side='left'))
    return first, last + 1


def _merged(boxes: list[Box]) -> list[tuple[list[int], Box]]:
    """Group parts that lie above each other; return those of each group and the box of all."""
    upright = [
        box.height >= _LEAST_BODY and _LEAST_ASPECT <= box.height / box.width <= _MOST_ASPECT
        for box in boxes
    ]
    crowd = sum(upright) >= _CROWD
    groups = [([index], box) for index, box in enumerate(boxes)]
    merged = True
    while merged:
        merged = False
        for first in range(len(groups)):
            for second in range(len(groups) - 1, first, -1):
                if _belong(groups[first][1], groups[second][1], crowd):
                    members, box = groups.pop(second)
                    groups[first] = (groups[first][0] + members, groups[first][1].union(box))
                    merged = True
    return groups


def _belong(a: Box, b: Box, crowd: bool) -> bool:
    """Tell whether two parts are of one body; in a crowd not if neither is much smaller."""
    across = min(a.right, b.right) - max(a.x, b.x)
    if across < _OVERLAP * min(a.width, b.width):
        return False
    if crowd and min(a.height, b.height) > _SMALL * max(a.height, b.height):
        return False
    both = a.union(b)
    if both.width > 1.2 * both.height and across < 0.8 * min(a.width, b.width):
        return False
    apart = max(a.y, b.y) - min(a.bottom, b.bottom)
    return apart < _DISTANCE * both.height


@kernel(
    'u2[:,::1], i4[::1], u1[:,::1], u1[:,::1], i8, UniTuple(i8, 4), u1[:,::1], '
    'i4[::1], i4[::1], i4[::1]'
)
def _fill(
    labels: NDArray[np.uint16],
    table: NDArray[np.int32],
    evidence: NDArray[np.uint8],
    moving: NDArray[np.uint8],
    group: int,
    bounds: tuple[int, int, int, int],
    filled: NDArray[np.uint8],
    rows: NDArray[np.int32],
    columns: NDArray[np.int32],
    measures: NDArray[np.int32],
) -> None:
    """Fill a group's rows between its moving pixels; count what is filled and what is not."""
    for row in range(bounds[0], bounds[1]):
        first, last = bounds[3], -1
        for col in range(bounds[2], bounds[3]):
            if evidence[row, col] == 0 or table[labels[row, col]] != group:
                continue
            measures[0] += 1
            if moving[row, col]:
                measures[1] += 1
                first = min(first, col)
                last = col
        for col in range(first, last + 1):
            filled[row, col] = 255
            columns[col] += 1
        rows[row] = max(last + 1 - first, 0)


def columns_of_people(part: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """
    Return the columns of each of the people in a part, from left to right.

    Heads are peaks of the upper outline with a gap between.

    :param part: (h, w) bool, true on what hangs together, with something in the outer rows and
        columns.
    :returns: first column and the one after the last; all columns if there is but one head.
    """
    height, width = part.shape
    if height < _HEADS_FROM or width < _TWO_FROM * height:
        return [(0, width)]
    top = np.where(part.any(axis=0), part.argmax(axis=0), height)
    heads: list[int] = []
    order = np.argsort(top, kind='stable')
    for column in order[top[order] <= _HIGH * height].tolist():
        if all(_gap(top, column, head, height) is not None for head in heads):
            heads.append(column)
    gaps = [_gap(top, *pair, height) for pair in itertools.pairwise(sorted(heads))]
    return list(itertools.pairwise([0, *(gap for gap in gaps if gap is not None), width]))


def _gap(top: NDArray[np.int64], one: int, two: int, height: int) -> int | None:
    """Return the middle of the gap between two heads, None if there is none."""
    left, right = min(one, two), max(one, two)
    if right - left < _APART * height:
        return None
    between = top[left : right + 1]
    lowest = int(between.max())
    if lowest - max(int(top[left]), int(top[right])) < _DEEP * height:
        return None
    return left + round(float(np.flatnonzero(between == lowest).mean()))


class BodyShapes:
    """Templates of a bank, tight about the body and small."""

    def __init__(self, bank: TemplateBank, step: int = 1) -> None:
        """Take every other phase of a bank, and of its views one of each ``step``."""
        rows = bank.templates.shape[2]
        top, bottom = round(rows * (1 - bank.fill) / 2), round(rows * (1 + bank.fill) / 2)
        chosen = bank.templates[::step, ::2].reshape(-1, *bank.templates.shape[2:])
        # A template is never wider than twice its height.
        shapes = [normalised(template[top:bottom]) for template in chosen]
        self._shapes = np.stack([shape for shape in shapes if shape is not None])

    def likeness(self, shape: NDArray[np.uint8]) -> float:
        """Return the similarity of a normalised shape with the template most like it, 0 to 1."""
        return float(tanimoto(self._shapes, shape).max())


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
