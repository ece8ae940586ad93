# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How well phases, views and placements fit a likelihood: squared differences, pixel by pixel."""

from __future__ import annotations

import math
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank, fine_grid
from gait_segmentation.geometry import BodyFrame
from gait_segmentation.kernels import kernel
from gait_segmentation.matching.path import WIDEST, Views
from gait_segmentation.matching.placements import antialiasing_side, resampled

_FINE_REACH = 3
_ERROR = math.radians(7.0)  # by how much the view a path begins with is wrong, standard deviation

HEIGHTS = (0.975, 1.0, 1.025)
"""Factors on the height of the body that are compared."""
ROWS = (-1, 0, 1)
"""
Shifts down, in halves of the views' pixels, that are compared.  Of as many shifts to the right
the best one counts.
"""
_MARGIN = 2  # samples about the grid on each side, by which it can be shifted
# Least difference of the mean likelihoods inside and outside that tells anything.
_LEAST_CONTRAST = 0.05 * 255
_AROUND = np.ones((3, 3), np.uint8)
_ALL = 255

Floats = NDArray[np.float32]


class FineViews(Views):
    """
    The walkers of a bank, in its finer views if it has such.

    Views 22.5 degrees apart are too coarse for the phase of a person seen from the front, and so
    is blending them.  A *place* counts the views of a build anticlockwise.  Nothing is written
    after making, so that matchers may share it.
    """

    def __init__(self, bank: TemplateBank) -> None:
        """Take the finer views, or those that the bank is searched by."""
        super().__init__(bank.finer or bank)
        self.templates: NDArray[np.uint8] = (
            _resized(bank.templates, fine_grid(bank.grid))
            if bank.finer is None
            else bank.finer.templates
        )
        """(V, P, h, w) uint8 in the grid of ``fine_grid``."""
        rings = [self.azimuths[ring] for ring in self.rings.values()]
        widest = max(np.diff(ring, append=ring[0] + 2 * math.pi).max() for ring in rings)
        self._count = min(map(len, rings))
        reach = 1 if bank.finer is None else _FINE_REACH
        self.reach = 0 if widest > WIDEST else min(reach, (self._count - 1) // 2)
        """How many views to either side are compared."""

    def place(self, build: str, azimuth: float) -> int:
        """Return the place of the view nearest to an azimuth."""
        away = np.exp(1j * (self.azimuths[self.rings[build]] - azimuth)).real
        return int(away.argmax())

    def steps(self, build: str, start: int, end: int) -> int:
        """Return the shorter way round from one place to another, positive anticlockwise."""
        count = len(self.rings[build])
        return (end - start + count // 2) % count - count // 2

    def around(self, build: str, place: int) -> tuple[int, ...]:
        """Return the indices of the views about a place, clockwise ones first."""
        ring = self.rings[build]
        reach = np.arange(-self.reach, self.reach + 1)
        return tuple(ring[(place + reach) % len(ring)].tolist())

    def likely(self) -> NDArray[np.float64]:
        """Return how likely the views about a place are, (2 reach + 1,), if it was seen once."""
        away = 2 * math.pi / self._count * np.arange(-self.reach, self.reach + 1)
        return np.asarray(np.exp(-0.5 * (away / _ERROR) ** 2))


@lru_cache(maxsize=2)
def fine_views(bank: TemplateBank) -> FineViews:
    """Return the views of a bank; those of the last banks are kept and shared."""
    return FineViews(bank)


def _resized(templates: NDArray[np.uint8], grid: tuple[int, int]) -> NDArray[np.uint8]:
    """Resample (V, P, H, W) uint8 templates, averaging where they shrink."""
    views, phases, height, width = templates.shape
    result = np.empty((views * phases, *grid), np.uint8)
    for index, template in enumerate(templates.reshape(-1, height, width)):
        cv2.resize(template, grid[::-1], result[index], interpolation=cv2.INTER_AREA)
    return result.reshape(views, phases, *grid)


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
        """Keep the templates, of whose rows the body takes the share ``fill``."""
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
        :param phase: one that fits the middle view, by which person and surroundings are separated
            apart.
        :param wanted: (V, S, Y) bool, views, heights and rows to compare.
        :returns: (V, S, Y, P) float64, up to a constant half the sum of squared differences in
            quarters of the views' pixels at the height of ``body``, negative; of the columns
            about the best one; -inf where not wanted.  Zeros if nothing is known.
        """
        self._choose(views)
        shape = (*wanted.shape, self._squares.shape[1])
        rows, columns = (2 * side for side in self._views.templates.shape[2:])
        grids = HEIGHTS, (rows + 2 * _MARGIN, columns + 2 * _MARGIN), self._fill * rows
        side = antialiasing_side(body.height / grids[-1])
        # From each half pixel of the views on, the mean over a pixel of them.
        images, masks = resampled(likelihood, known, body, *grids, side)
        values, seen = (
            _paired(images),
            None if masks is None else _paired(masks) / np.float32(_ALL),
        )
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
        fixed = values, seen, levels, self._part, wanted
        _compare(self._templates, self._squares, *fixed, weights, result)
        return result

    def _choose(self, views: tuple[int, ...]) -> None:
        """Take the used part of the templates of some views, in 0..1."""
        if views == self._chosen:
            return
        chosen = self._views.templates[list(views)]
        left, top, width, height = cv2.boundingRect(chosen.max(axis=(0, 1)))
        # At least one pixel.
        self._part = top, left, max(height, 1), max(width, 1)
        used = chosen[:, :, top : top + self._part[2], left : left + self._part[3]]
        flat = used.astype(np.float32) / _ALL
        self._templates = np.ascontiguousarray(flat.reshape(*flat.shape[:2], -1))
        self._squares = (self._templates**2).sum(axis=2)
        self._chosen = views


def _levels(
    values: Floats, seen: Floats | None, template: NDArray[np.uint8]
) -> tuple[float, float] | None:
    """Return mean likelihoods well inside the person and well outside, None if too alike."""
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
    """Put minus half the least sums of squared differences of the templates into ``result``."""
    # Not by matrix products: those of BLAS wait for each other's threads where cores are busy.
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
