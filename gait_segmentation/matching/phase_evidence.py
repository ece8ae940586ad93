# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How well phases, views and placements fit a likelihood: squared differences, pixel by pixel."""

from __future__ import annotations

import dataclasses

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import BodyFrame, compose, template_to_image
from gait_segmentation.kernels import kernel
from gait_segmentation.matching.sampling import antialiasing_side, resampled
from gait_segmentation.matching.views import FineViews

HEIGHTS = (0.975, 1.0, 1.025)
"""Factors on the height of the body that are compared."""
ROWS = (-1, 0, 1)
"""
Shifts down, in halves of the views' pixels, that are compared.  Of as many shifts to the right
the best one counts.
"""
_MARGIN = 2
"""Samples about the grid on each side, by which it can be shifted."""
_LEAST_CONTRAST = 0.05 * 255
"""Least difference of the mean likelihoods inside and outside that tells anything."""
_AROUND = np.ones((3, 3), np.uint8)
_ALL = 255

Floats = NDArray[np.float32]


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
        self._views, self._fill = views, fill
        self._chosen: tuple[int, ...] = ()

    @property
    def cells(self) -> NDArray[np.float64]:
        """Return how likely the views, heights and rows that are compared are at first."""
        views = self._views.likely()
        return np.tile(views[:, None, None], (1, len(HEIGHTS), len(ROWS)))

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
        self._choose(views)
        shape = (*wanted.shape, self._squares.shape[1])
        values, seen = self._sampled(likelihood, known, body)
        middle, inner = HEIGHTS.index(1.0), slice(_MARGIN, -_MARGIN, 2)
        levels = _levels(
            values[middle, inner, inner],
            None if seen is None else seen[middle, inner, inner],
            self._views.templates[views[len(views) // 2], phase],
        )
        if levels is None:
            return np.zeros(shape)
        result = np.full(shape, -np.inf)
        seen = values[:0] if seen is None else seen
        weights = 4 * np.square(HEIGHTS)
        images = values, seen, levels, self._part
        _compare(self._templates, self._squares, *images, wanted, weights, result)
        return result

    def _sampled(
        self, likelihood: NDArray[np.uint8], known: NDArray[np.uint8] | None, body: BodyFrame
    ) -> tuple[Floats, Floats | None]:
        """
        Resample the likelihood at each height.

        :returns: (S, 2 h + 4, 2 w + 4) float32, from each half pixel of the views on, the mean
            over a pixel of them, up to 255; and the share known of that, None if all is.
        """
        height, width = (2 * side for side in self._views.templates.shape[2:])
        size = (width + 2 * _MARGIN, height + 2 * _MARGIN)
        shift = np.array([[1.0, 0.0, -_MARGIN], [0.0, 1.0, -_MARGIN]])
        grids = []
        for factor in HEIGHTS:
            other = dataclasses.replace(body, height=body.height * factor)
            grids.append(compose(template_to_image(other, height, width, self._fill), shift))
        side = antialiasing_side(body.height / (self._fill * height))
        images, masks = resampled(likelihood, known, grids, size, side)
        return _paired(images), None if masks is None else _paired(masks) / np.float32(_ALL)

    def _choose(self, views: tuple[int, ...]) -> None:
        """Take the used part of the templates of some views, in 0..1."""
        if views == self._chosen:
            return
        chosen = self._views.templates[list(views)]
        used = chosen.max(axis=(0, 1)) > 0
        rows, columns = _span(used.any(axis=1)), _span(used.any(axis=0))
        self._part = (
            rows.start,
            columns.start,
            rows.stop - rows.start,
            columns.stop - columns.start,
        )
        flat = chosen[:, :, rows, columns].astype(np.float32) / _ALL
        self._templates = np.ascontiguousarray(flat.reshape(*flat.shape[:2], -1))
        self._squares = (self._templates**2).sum(axis=2)
        self._chosen = views


def _levels(
    values: Floats, seen: Floats | None, template: NDArray[np.uint8]
) -> tuple[float, float] | None:
    """
    Return the mean likelihood well inside the person and well outside, None if too alike.

    At the outline the template need not fit yet.

    :param values: (h, w) float32 up to 255, and ``seen`` in 0..1: what is known of each pixel.
    """
    if seen is not None:
        # The values are 0 where nothing is known; where half is, they are half as large.
        values = values / np.maximum(seen, np.float32(0.25))
    means = []
    for part in (cv2.erode(template, _AROUND), _ALL - cv2.dilate(template, _AROUND)):
        weight = part.astype(np.float32) if seen is None else part * seen
        area = float(weight.sum())
        if area < _ALL:
            return None
        means.append(float((weight * values).sum()) / area)
    person, ground = means
    return (person, ground) if person - ground >= _LEAST_CONTRAST else None


def _span(used: NDArray[np.bool_]) -> slice:
    """Return the part of an axis that is used, at least one element."""
    found = np.flatnonzero(used)
    return slice(int(found[0]), int(found[-1]) + 1) if len(found) else slice(0, 1)


def _paired(images: NDArray[np.uint8]) -> Floats:
    """Return the means of the 2 x 2 pixels from each pixel on."""
    means = np.empty(images.shape, np.float32)
    for image, result in zip(images, means, strict=True):
        cv2.boxFilter(image, cv2.CV_32F, (2, 2), result, anchor=(0, 0))
    return means


@kernel(
    'f4[:,:,::1], f4[:,::1], f4[:,:,::1], f4[:,:,::1], UniTuple(f8, 2), UniTuple(i8, 4), '
    'b1[:,:,::1], f8[::1], f8[:,:,:,::1]',
    fastmath=True,
)
def _compare(  # type: ignore[no-untyped-def]
    templates, squares, values, seen, levels, part, wanted, weights, result
):
    """
    Put minus half the least sum of squared differences of each template into ``result``.

    Not by matrix products: those of BLAS wait for each other's threads where cores are busy.

    :param templates: (V, P, n) float32, and ``squares`` (V, P) the sums of their squares.
    :param values: (S, h, w) float32, and ``seen`` likewise, or (0, h, w) if all is known.
    :param levels: values that mean 1 and 0.
    :param part: first row and column, and numbers of rows and columns that the templates have.
    """
    top, left, height, width = part
    person, ground = np.float32(levels[0]), np.float32(levels[1])
    scale, half, all_seen = np.float32(1) / (person - ground), np.float32(0.5), len(seen) == 0
    # One for each column; the best one counts.
    lines = np.empty((3, height * width), np.float32)
    shown = np.ones((3, height * width), np.float32)
    for tall in range(len(values)):
        for down in range(3):
            if not wanted[:, tall, down].any():
                continue
            for across in range(3):
                place = _MARGIN + 2 * top + down - 1, _MARGIN + 2 * left + across - 1, width
                _cut(values[tall], *place, lines[across])
                if not all_seen:
                    _cut(seen[tall], *place, shown[across])
                line, visible = lines[across], shown[across]
                for j in range(len(line)):
                    line[j] = (line[j] - ground * visible[j]) * scale
            for view in range(len(templates)):
                if not wanted[view, tall, down]:
                    continue
                for phase in range(templates.shape[1]):
                    own = templates[view, phase]
                    first, second, third = _products(own, lines)
                    if all_seen:
                        best = max(first, second, third) - half * squares[view, phase]
                    else:
                        one, two, three = _products(own * own, shown)
                        best = max(first - half * one, second - half * two, third - half * three)
                    result[view, tall, down, phase] = weights[tall] * best


@kernel()
def _cut(image, top, left, width, line):  # type: ignore[no-untyped-def]
    """Put every other pixel of a part of an image, row by row, into a line."""
    for row in range(len(line) // width):
        source, target = image[top + 2 * row], line[row * width :]
        for column in range(width):
            target[column] = source[left + 2 * column]


@kernel(fastmath=True)
def _products(template, lines):  # type: ignore[no-untyped-def]
    """Return the products of a template with three lines."""
    first, second, third = np.float32(0), np.float32(0), np.float32(0)
    for j in range(len(template)):
        first += template[j] * lines[0, j]
        second += template[j] * lines[1, j]
        third += template[j] * lines[2, j]
    return first, second, third
