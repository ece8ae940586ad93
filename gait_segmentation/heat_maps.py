# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Heat maps: where people are as others see it, such as a network."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import InputError
from gait_segmentation.geometry import Box

_MOST_KEPT = 16
"""Maps kept whose frames have not come."""

_ABOUT_PX = 4
"""How far about an outline the slopes are that those on it are compared with, in pixels."""

_LEAST_OUTLINE, _MOST_POINTS = 30, 2000
"""Pixels of an outline from which it tells anything, and how many are looked at, at most."""

_COMPARED_SIZE, _COMPARED = 320, 3
"""Longest side at which map and frame are compared, in pixels, and which of the maps are."""

_TRUST_RATE = 0.2
"""Share by which the alignment moves towards that of the newest map."""

_ASTRAY, _ALIGNED = 0.8, 1.0
"""Alignment up to which a map is of something else, and from which it counts in full."""

_MOST_RIM = 0.6
"""Most of the image's rim that people take up."""

_OWN = 0.1
"""
Share of the smaller of a region and the expected person that both have in common, from which the
region is theirs.
"""


@dataclass(frozen=True)
class HeatMap:
    """
    A heat map of people: (h, w) uint8 of any size, and the stamp of its frame.

    ``trust`` is how far it counts, 0 to 1, see :class:`MapTrust`.
    """

    values: NDArray[np.uint8]
    stamp_ns: int
    trust: float = 0.0


def alignment(values: NDArray[np.uint8], lab: NDArray[np.uint8]) -> float | None:
    """
    Return how well the outline of a map lies on edges of the image, None without an outline.

    That is the gradient across the outline over that in any direction near it, in the mean: 2 / pi
    where they have nothing to do with each other, about 1.4 where the map is right.

    :param values: (h, w) uint8.
    :param lab: (h, w, 3) uint8, the image in Lab.
    """
    inside = np.asarray(cv2.threshold(values, 127, 255, cv2.THRESH_BINARY)[1])
    outline, about = (
        cv2.morphologyEx(inside, cv2.MORPH_GRADIENT, np.ones((size, size), np.uint8))
        for size in (3, 2 * _ABOUT_PX + 1)
    )
    soft = cv2.GaussianBlur(values, (5, 5), 0)
    on, near = (_inner_points(each) for each in (outline, about))
    if len(on[0]) < _LEAST_OUTLINE:
        return None
    x, y = _slopes(lab, near)
    total = np.hypot(x, y).sum(axis=1).mean()
    x, y = _slopes(lab, on)
    across, down = (each[:, None] for each in _slopes(soft, on))
    normal = np.abs(x * across + y * down) / np.maximum(np.hypot(across, down), 1e-3)
    return float(normal.sum(axis=1).mean() / max(total, 1e-3))


def _inner_points(marked: NDArray[np.uint8]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return rows and columns of what is marked, off the border, not more than are needed."""
    points = np.flatnonzero(marked[1:-1, 1:-1])
    points = points[:: 1 + len(points) // _MOST_POINTS]
    rows, columns = np.divmod(points, marked.shape[1] - 2)
    return rows + 1, columns + 1


def _slopes(
    image: NDArray[np.uint8], points: tuple[NDArray[np.intp], NDArray[np.intp]]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the slopes of an image at some points, across and down."""
    rows, columns = points
    right, left = image[rows, columns + 1], image[rows, columns - 1]
    below, above = image[rows + 1, columns], image[rows - 1, columns]
    return np.subtract(right, left, dtype=np.float32), np.subtract(below, above, dtype=np.float32)


def label_regions(
    values: NDArray[np.uint8], level: int = 127
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """
    Label the regions that a map shows above a level; the first is what is none.

    :param values: (h, w) uint8, P(person).
    :returns: (h, w) int32 labels, and for each left, top, width, height and area, (n, 5) int32.
    """
    # Not cv2.compare: that takes an image of one pixel for something else.
    above = cv2.inRange(values, level + 1, 255)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(above)
    return np.asarray(labels, np.int32), np.asarray(stats, np.int32)


def regions(values: NDArray[np.uint8]) -> list[tuple[Box, int]]:
    """Return the box and the area of each region that a map, (h, w) uint8, shows."""
    return [(Box(*row[:4]), row[4]) for row in label_regions(values)[1][1:].tolist()]


def own_regions(values: NDArray[np.uint8], expected: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """
    Return a map without the regions of others, (h, w) uint8.

    :param values: (h, w) uint8, P(person).
    :param expected: (h, w) uint8, above 127 where the person is expected.
    """
    labels, stats = label_regions(values)
    person = expected > 127
    areas = stats[:, cv2.CC_STAT_AREA]
    common = np.bincount(labels[person], minlength=len(areas))
    others = common < _OWN * np.minimum(areas, np.count_nonzero(person))
    others[0] = False
    return np.where(others[labels], np.uint8(0), values) if others.any() else values


class MapTrust:
    """
    How far the maps of a stream count, by how their outlines lie on edges of their frames.

    No mask is needed for it, so a map is believed, or not, whatever masks say.
    """

    def __init__(self) -> None:
        """Begin without a map."""
        self._alignment: float | None = None
        self._stamp_ns, self._maps = 0, 0
        self._size: tuple[int, int] | None = None
        self._frames: deque[tuple[int, NDArray[np.uint8]]] = deque(maxlen=_MOST_KEPT)

    def update(self, image: NDArray[np.uint8], stamp_ns: int, heat_map: HeatMap | None) -> float:
        """
        Take in a frame and the newest map, which may be of an earlier one.

        :param image: (H, W, 3) uint8 BGR.
        :returns: the trust, 0 to 1.
        """
        if heat_map is not None and self._size is None:
            height, width = image.shape[:2]
            scale = min(1.0, _COMPARED_SIZE / max(height, width))
            self._size = max(1, round(scale * width)), max(1, round(scale * height))
        if self._size is not None:
            # From the first map on, as maps may come later than their frames.
            small = cv2.resize(image, self._size, interpolation=cv2.INTER_LINEAR)
            self._frames.append((stamp_ns, small))
        if heat_map is not None and heat_map.stamp_ns != self._stamp_ns:
            self._stamp_ns = heat_map.stamp_ns
            if self._alignment is None or self._maps % _COMPARED == 0:
                self._compare(heat_map)
            self._maps += 1
        known = _ASTRAY if self._alignment is None else self._alignment
        return float(np.clip((known - _ASTRAY) / (_ALIGNED - _ASTRAY), 0, 1))

    def _compare(self, heat_map: HeatMap) -> None:
        nearest = min(self._frames, key=lambda frame: abs(frame[0] - heat_map.stamp_ns))
        lab = np.asarray(cv2.cvtColor(nearest[1], cv2.COLOR_BGR2Lab))
        values = cv2.resize(heat_map.values, self._size, interpolation=cv2.INTER_LINEAR)
        found = alignment(np.asarray(values), lab)
        rim = np.concatenate([values[0], values[-1], values[:, 0], values[:, -1]])
        if np.count_nonzero(rim > 127) > _MOST_RIM * rim.size:
            # It shows what people are not, as one that is inverted.
            found = 0.0
        if found is not None:
            before = found if self._alignment is None else self._alignment
            self._alignment = before + _TRUST_RATE * (found - before)


class HeatMaps:
    """The newest heat maps, which may come before their frames or after."""

    def __init__(self) -> None:
        """Begin without a map."""
        self._maps: deque[HeatMap] = deque(maxlen=_MOST_KEPT)
        self.forget()

    def forget(self) -> None:
        """Forget how far maps could be trusted, but not those that wait."""
        self._trust = MapTrust()

    def add(self, heat_map: NDArray[Any], stamp_ns: int) -> None:
        """Take in a map, which may be changed afterwards; InputError, see :func:`heat_map_of`."""
        values = heat_map_of(heat_map)
        if np.shares_memory(values, heat_map):
            values = values.copy()
        self._maps.append(HeatMap(values, stamp_ns))

    def newest(self, image: NDArray[np.uint8], stamp_ns: int, age_s: float) -> HeatMap | None:
        """
        Return the newest map for a frame, None if all are older than an age.

        :param image: (H, W, 3) uint8 BGR; each frame in turn.
        :param age_s: in seconds; with 0 only the map of the very frame will do.
        """
        least = stamp_ns - round(age_s * 1e9)
        fitting = [each for each in self._maps if least <= each.stamp_ns <= stamp_ns]
        found = max(fitting, key=lambda each: each.stamp_ns, default=None)
        trust = self._trust.update(image, stamp_ns, found)
        return found and replace(found, trust=trust)


def heat_map_of(array: NDArray[Any]) -> NDArray[np.uint8]:
    """
    Return a heat map of any supported kind as (h, w) uint8, 255 = surely a person.

    :param array: (h, w), or (h, w, c) if all colours are equal (a fourth channel is opacity, which
        is ignored): uint8, uint16 or floating point numbers from 0 to 1.
    :raises InputError: if it has another shape or type, no pixel, or numbers that are not
        finite.
    """
    if not isinstance(array, np.ndarray):
        raise InputError(f'heat map must be an array, got {type(array).__name__}')
    if array.ndim == 3 and array.shape[2] in (1, 3, 4):
        if (array[..., :1] != array[..., : min(array.shape[2], 3)]).any():
            raise InputError('heat map must be grey, got colours')
        array = array[..., 0]
    if array.ndim != 2 or array.size == 0:
        raise InputError(f'heat map must be (height, width) with pixels, got {array.shape}')
    if array.dtype == np.uint16:
        array = (array >> 8).astype(np.uint8)
    if np.issubdtype(array.dtype, np.floating):
        if not np.isfinite(array).all():
            raise InputError('heat map must be of finite numbers, got NaN or infinity')
        least, most = float(array.min()), float(array.max())
        if least < 0 or most > 1:
            raise InputError(f'heat map must be from 0 to 1, got {least:g} to {most:g}')
        array = np.rint(255 * array).astype(np.uint8)
    if array.dtype != np.uint8:
        raise InputError(f'heat map must be of uint8, uint16 or floats, got {array.dtype}')
    return np.ascontiguousarray(array)
