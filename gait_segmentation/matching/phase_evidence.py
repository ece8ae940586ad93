# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How well phases, views and placements fit a likelihood: squared differences, pixel by pixel."""

from __future__ import annotations

import dataclasses

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import BodyFrame, compose, template_to_image as to_image
from gait_segmentation.kernels import kernel
from gait_segmentation.matching.fine_views import FineViews
from gait_segmentation.matching.sampling import antialiasing_side, resampled

__all__ = ['FineEvidence']

HEIGHTS = (0.975, 1.0, 1.025)
"""Factors on the height of the body that are compared."""
ROWS = (-1, 0, 1)
"""Shifts down, in halves of the views' pixels, that are compared."""
_COLUMNS = (-1, 0, 1)
"""Shifts to the right; the best one counts."""
_MARGIN = 2
"""Samples about the grid on each side, by which it can be shifted."""
_LEAST_CONTRAST = 0.05
"""Least difference of the mean likelihoods (0..1) inside and outside that tells anything."""
_AROUND = np.ones((3, 3), np.uint8)
_ALL = 255

_Views = tuple[NDArray[np.float32], NDArray[np.float32], tuple[slice, slice]]
"""The used part of the templates of some views in 0..1, (V, P, n), the sums of its squares
(V, P), and where the part is."""


class FineEvidence:
    """
    Compares views, heights and rows about a body, and all phases of each.

    The Tanimoto similarity favours large templates where the surroundings are not black, and
    stores only how much is alike; differences as small as those between the phases of a walker
    seen from the front drown in that.  Here the likelihood is scaled so that the person is 1 and
    the surroundings 0 on average, and compared by half the sum of squared differences, which is
    the logarithm of the probability for independent errors of the pixels.

    It is sampled twice as finely as the views, so that they can be shifted by half their pixels.
    """

    def __init__(self, views: FineViews, fill: float) -> None:
        """
        Keep the templates.

        :param fill: share of the rows the body takes.
        """
        self._views = views
        height, width = views.templates.shape[2:]
        self._grid = 2 * height, 2 * width
        self._fill = fill
        self._kept: tuple[tuple[int, ...], _Views] | None = None

    @property
    def cells(self) -> NDArray[np.float64]:
        """Return how likely the views, heights and rows that are compared are at first."""
        views = self._views.likely()
        return np.repeat(views, len(HEIGHTS) * len(ROWS)).reshape(-1, len(HEIGHTS), len(ROWS))

    def at(
        self,
        likelihood: NDArray[np.uint8],
        known: NDArray[np.uint8] | None,
        body: BodyFrame,
        views: tuple[int, ...],
        phase: int,
        wanted: NDArray[np.bool_],
    ) -> NDArray[np.float64]:
        """
        Compare the phases of views at placements about a body.

        :param likelihood: (h, w) uint8.
        :param known: (h, w) uint8, 0 where the likelihood says nothing; None = known everywhere.
        :param body: where the body is thought to be, in the likelihood's pixels.
        :param views: V indices into the templates of the views.
        :param phase: one that fits the middle view, by which person and surroundings are told
            apart.
        :param wanted: (V, S, Y) bool, views, heights and rows to compare.
        :returns: (V, S, Y, P) float64, up to a constant half the sum of squared differences in
            quarters of the views' pixels at the height of ``body``, negative; of the columns
            about the best one; -inf where not wanted.  Zeros if nothing can be told.
        """
        templates, squares, part = self._part(views)
        count, phases, _ = templates.shape
        values, seen, everywhere = self._sampled(likelihood, known, body)
        middle = HEIGHTS.index(1.0)
        # The likelihood where the pixels of the views are.
        inner = slice(1, 1 + self._grid[0] // 2), slice(1, 1 + self._grid[1] // 2)
        levels = self._levels(
            values[middle, 0, 0][inner],
            seen[middle, 0, 0][inner],
            self._views.templates[views[count // 2], phase],
        )
        if levels is None:
            return np.zeros((*wanted.shape, phases))
        result = np.full((*wanted.shape, phases), -np.inf)
        compare(
            templates,
            squares,
            values,
            seen,
            everywhere,
            levels,
            (part[0].start, part[1].start, part[1].stop - part[1].start),
            wanted,
            np.array([4 * factor**2 for factor in HEIGHTS]),
            result,
        )
        return result

    def _levels(
        self, values: NDArray[np.float32], seen: NDArray[np.float32], template: NDArray[np.uint8]
    ) -> tuple[float, float] | None:
        """
        Return the mean likelihood well inside the person and well outside, None if too alike.

        At the outline the template need not fit yet.
        """
        within = cv2.erode(template, _AROUND).astype(np.float32) * seen
        beyond = (_ALL - cv2.dilate(template, _AROUND)).astype(np.float32) * seen
        area, around = float(within.sum()), float(beyond.sum())
        if area < _ALL or around < _ALL:
            return None
        # The values are 0 where nothing is known; where half is, they are half as large.
        shown = np.maximum(seen, np.float32(0.25))
        person = float((within * (values / shown)).sum()) / area
        ground = float((beyond * (values / shown)).sum()) / around
        return (person, ground) if person - ground >= _LEAST_CONTRAST else None

    def _sampled(
        self,
        likelihood: NDArray[np.uint8],
        known: NDArray[np.uint8] | None,
        body: BodyFrame,
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], bool]:
        """
        Resample the likelihood at each height.

        :returns: the likelihood and what is known of it, both (S, 2, 2, H / 2 + 2, W / 2 + 2)
            float32 in 0..1: means over a pixel of the views at every half pixel, from one above
            and left of the grid on; even rows, even columns first.
            And whether all is known.
        """
        height, width = self._grid
        size = (width + 2 * _MARGIN, height + 2 * _MARGIN)
        shift = np.array([[1.0, 0.0, -_MARGIN], [0.0, 1.0, -_MARGIN]])
        grids = [
            compose(
                to_image(
                    dataclasses.replace(body, height=body.height * factor),
                    height,
                    width,
                    self._fill,
                ),
                shift,
            )
            for factor in HEIGHTS
        ]
        side = antialiasing_side(body.height / (self._fill * height))
        images, masks = resampled(likelihood, known, grids, size, side)
        result = np.zeros((2, len(grids), 2, 2, size[1] // 2, size[0] // 2), np.float32)
        shown = np.full(images.shape, _ALL, np.uint8) if masks is None else masks
        pair(images, shown, result[0], result[1])
        return result[0], result[1], masks is None

    def _part(self, views: tuple[int, ...]) -> _Views:
        """Return the used part of the templates of some views."""
        if self._kept is None or self._kept[0] != views:
            chosen = self._views.templates[list(views)]
            used = chosen.max(axis=(0, 1)) > 0
            part = _span(used.max(axis=1)), _span(used.max(axis=0))
            flat = chosen[:, :, part[0], part[1]].astype(np.float32) / _ALL
            flat = flat.reshape(*flat.shape[:2], -1)
            self._kept = views, (np.ascontiguousarray(flat), (flat**2).sum(axis=2), part)
        return self._kept[1]


def _span(used: NDArray[np.bool_]) -> slice:
    """Return the part of an axis that is used, at least one element."""
    found = np.flatnonzero(used)
    return slice(int(found[0]), int(found[-1]) + 1) if len(found) else slice(0, 1)


@kernel(
    'f4[:,:,::1], f4[:,::1], f4[:,:,:,:,::1], f4[:,:,:,:,::1], b1, UniTuple(f8, 2), '
    'UniTuple(i8, 3), b1[:,:,::1], f8[::1], f8[:,:,:,::1]',
    fastmath=True,
)
def compare(  # type: ignore[no-untyped-def]
    templates, squares, values, seen, all_seen, levels, part, wanted, weights, result
):
    """
    Put minus half the least sum of squared differences of each template into ``result``.

    Not by matrix products: those of BLAS wait for each other's threads where cores are busy.

    :param templates: (V, P, n) float32, and ``squares`` (V, P) the sums of their squares.
    :param values: (S, 2, 2, h + 2, w + 2) float32, see :func:`pair`; ``seen`` likewise.
    :param levels: values that mean 1 and 0.
    :param part: first row, first column and width of the part that the templates have.
    """
    views, phases, count = templates.shape
    top, left, width = part
    ground, scale = np.float32(levels[1]), np.float32(1.0 / (levels[0] - levels[1]))
    scaled = np.empty(values.size, np.float32)
    flat, known = values.reshape(-1), seen.reshape(-1)
    for j in range(len(scaled)):
        scaled[j] = (flat[j] - ground * known[j]) * scale
    scaled = scaled.reshape(values.shape)
    # One for each column; the best one counts.
    lines = np.empty((3, count), np.float32)
    shown = np.empty((3, count), np.float32)
    for tall in range(values.shape[0]):
        for down in range(3):
            if not wanted[:, tall, down].any():
                continue
            for across in range(3):
                odd = (down + 1) % 2, (across + 1) % 2
                above, before = top + (down + 1) // 2, left + (across + 1) // 2
                _cut(scaled[tall, odd[0], odd[1]], above, before, width, lines[across])
                if not all_seen:
                    visible = seen[tall, odd[0], odd[1]]
                    _cut(visible, above, before, width, shown[across])
            for view in range(views):
                if not wanted[view, tall, down]:
                    continue
                for phase in range(phases):
                    own = templates[view, phase]
                    first, second, third = _alike(own, lines)
                    half = np.float32(0.5) * squares[view, phase]
                    best = max(first, second, third) - half
                    if not all_seen:
                        one, two, three = _squared(own, shown)
                        best = max(
                            first - np.float32(0.5) * one,
                            second - np.float32(0.5) * two,
                            third - np.float32(0.5) * three,
                        )
                    result[view, tall, down, phase] = weights[tall] * best


@kernel()
def _cut(image, top, left, width, line):  # type: ignore[no-untyped-def]
    """Put the rows of a part of an image one after the other into a line."""
    for row in range(len(line) // width):
        source, target = image[top + row], line[row * width :]
        for column in range(width):
            target[column] = source[left + column]


@kernel(fastmath=True)
def _alike(template, lines):  # type: ignore[no-untyped-def]
    """Return the products of a template with three lines."""
    first, second, third = np.float32(0), np.float32(0), np.float32(0)
    for j in range(len(template)):
        first += template[j] * lines[0, j]
        second += template[j] * lines[1, j]
        third += template[j] * lines[2, j]
    return first, second, third


@kernel(fastmath=True)
def _squared(template, lines):  # type: ignore[no-untyped-def]
    """Return the products of a template's squares with three lines."""
    first, second, third = np.float32(0), np.float32(0), np.float32(0)
    for j in range(len(template)):
        square = template[j] * template[j]
        first += square * lines[0, j]
        second += square * lines[1, j]
        third += square * lines[2, j]
    return first, second, third


@kernel('u1[:,:,::1], u1[:,:,::1], f4[:,:,:,:,::1], f4[:,:,:,:,::1]', fastmath=True)
def pair(images, masks, values, seen):  # type: ignore[no-untyped-def]
    """
    Put the means of 2 x 2 known pixels into ``values`` and what is known into ``seen``, in 0..1.

    :param images: (S, h, w) uint8, h and w even, black where unknown; ``masks`` are 0 there.
    :param values: (S, 2, 2, h / 2, w / 2) float32, and ``seen`` likewise: the means from even and
        from odd rows on, of each from even and from odd columns on.  What would begin in the
        last row or column is left as it is.
    """
    count, height, width = images.shape
    quarter = np.float32(0.25)
    share = quarter / np.float32(_ALL)
    total, known = np.zeros(width + 1, np.float32), np.zeros(width + 1, np.float32)
    for k in range(count):
        for y in range(height - 1):
            image, below = images[k, y], images[k, y + 1]
            mask, mask_below = masks[k, y], masks[k, y + 1]
            for x in range(width):
                total[x] = share * np.float32(np.int32(image[x]) + np.int32(below[x]))
                known[x] = share * np.float32(np.int32(mask[x]) + np.int32(mask_below[x]))
            for odd in range(2):
                value, visible = values[k, y % 2, odd, y // 2], seen[k, y % 2, odd, y // 2]
                for x in range(width // 2 - odd):
                    value[x] = total[2 * x + odd] + total[2 * x + odd + 1]
                    visible[x] = known[2 * x + odd] + known[2 * x + odd + 1]
