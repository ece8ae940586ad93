# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is said of a person in one image, by whatever sees them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import Box
from gait_segmentation.images import Window, count_likely, size_of

SAME_PERSON = 0.3
"""Intersection over union from which two boxes in one image are taken for those of one person."""

PART = 0.4
"""Share of the smaller of two boxes in common from which one may show a part of the other."""


_FITS = 0.5
"""Intersection over union of a box and that of a mask, from which it is of who is in it."""

_LEAST_DRAWN = 21
"""Pixels of a mask, as the network gives it, from which it has a box."""


@dataclass(frozen=True)
class SoftMask:
    """
    P(person) of one person in a square about them.

    ``values`` is (n, n) uint8, 255 = certain; pixel (x, y) of the image lies at ``scale`` * (x, y)
    + ``offset`` in it.  Outside of ``limits``, in pixels of the image, it may be of others.
    ``presence`` are the log-odds that somebody is in the middle of the square, 0 if not known.
    """

    values: NDArray[np.uint8]
    scale: float
    offset: tuple[float, float]
    limits: Box
    presence: float = 0.0

    @cached_property
    def box(self) -> Box | None:
        """Return the tight box of what is surely theirs, in the image, None if hardly any is."""
        sure = self.values > 127
        if np.count_nonzero(sure) < _LEAST_DRAWN or (box := Box.around(sure)) is None:
            return None
        x, y = self.offset
        return box.shifted(-x, -y).scaled(1 / self.scale)

    def fits(self, box: Box) -> bool:
        """Return whether it is of somebody in a box of the image."""
        return self.box is not None and self.box.iou(box) >= _FITS

    def iou(self, mask: NDArray[np.uint8], window: Window, scale: float) -> float:
        """
        Return the intersection over union with another mask.

        :param mask: (h, w) uint8 of a window of the image made larger by ``scale``.
        """
        both, own = self._common(mask, window, scale)
        return both / max(own + count_likely(mask) - both, 1.0)

    def share_on(self, mask: NDArray[np.uint8], window: Window, scale: float) -> float:
        """Return the share of it that lies on another mask; see :meth:`iou`."""
        both, own = self._common(mask, window, scale)
        return both / max(own, 1.0)

    def _common(self, mask: NDArray[np.uint8], window: Window, scale: float) -> tuple[int, float]:
        """Return the areas of what it and another mask have in common, and of its own."""
        # Unlike OpenCV's, of a window outside of the image, too.
        both = count_likely(np.minimum(self.drawn(window, scale, (0.0, 0.0)), mask))
        return both, count_likely(self.values) * (scale / self.scale) ** 2

    def drawn(self, window: Window, scale: float, shift: tuple[float, float]) -> NDArray[np.uint8]:
        """
        Return a window of the mask at another scale, (h, w) uint8.

        :param window: rows and columns of the image made larger by ``scale``.
        :param shift: how far the person has gone since, in pixels of that.
        """
        rows, columns = window
        gain = self.scale / scale
        x, y = columns.start - shift[0], rows.start - shift[1]
        # From the middle of a pixel to that of another.
        half = (gain - self.scale) / 2
        there = np.array(
            [
                [gain, 0, gain * x + self.offset[0] + half],
                [0, gain, gain * y + self.offset[1] + half],
            ]
        )
        height, width = size_of(window)
        how = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        values = cv2.warpAffine(self.values, there, (width, height), flags=how)
        out = np.zeros((height, width), np.uint8)
        inside = self.limits.scaled(scale).shifted(-x, -y).slices(width, height)
        out[inside] = values[inside]
        return out


@dataclass(frozen=True)
class Detection:
    """
    A person in an image: a tight box in pixels of the image, and how sure that is (0..1).

    ``mask`` is what a network has drawn of them, None where none did; ``by_map`` says that they
    are a region of a heat map.
    """

    box: Box
    score: float
    mask: SoftMask | None = None
    by_map: bool = False


def associate(
    tracks: Sequence[Sequence[Box]],
    detections: Sequence[Detection],
    known: Mapping[int, int] | None = None,
) -> dict[int, int]:
    """
    Give detections to tracks, one to one, the pairs that overlap most first.

    :param tracks: the boxes in which each track may be seen, in the frame of the detections, in
        source pixels.
    :param known: pairs that stand already, as they are returned.
    :returns: the numbers of detections by those of tracks.
    """
    overlaps = sorted(
        (
            (-max(box.iou(detection.box) for box in boxes), track, number)
            for track, boxes in enumerate(tracks)
            for number, detection in enumerate(detections)
        ),
    )
    pairs = dict(known or {})
    for cost, track, number in overlaps:
        if -cost >= SAME_PERSON and track not in pairs and number not in pairs.values():
            pairs[track] = number
    return pairs


def merged(people: Sequence[Detection], closer: Sequence[Detection]) -> list[Detection]:
    """Return people of two looks at an image, each once, as the surer saw them; the best first."""
    found = list(people)
    pairs = associate([[each.box] for each in people], closer)
    for number, other in pairs.items():
        found[number] = max(found[number], closer[other], key=lambda each: each.score)
    found += (each for number, each in enumerate(closer) if number not in pairs.values())
    return sorted(found, key=lambda each: -each.score)
