# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Placements of templates about a box, and the likelihood resampled for them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import BodyFrame, Box, Placement, template_to_image
from gait_segmentation.matching.common_areas import WindowGrid
from gait_segmentation.matching.config import MatchingConfig
from gait_segmentation.matching.sampling import antialiasing_side, resampled

_EVERY_HEIGHT = slice(None)

Place = tuple[int, int, int]
"""Body height, row and column of a placement."""


class SearchRange(NamedTuple):
    """
    A box of placements: body heights, rows and columns from ``first`` on, ``shape`` of each.

    Placements in it have *lanes*, columns running fastest.
    """

    first: Place
    shape: Place

    @property
    def heights(self) -> slice:
        """Return the body heights."""
        return self._along(0)

    @property
    def rows(self) -> slice:
        """Return the rows."""
        return self._along(1)

    @property
    def columns(self) -> slice:
        """Return the columns."""
        return self._along(2)

    def _along(self, axis: int) -> slice:
        return slice(self.first[axis], self.first[axis] + self.shape[axis])

    @property
    def size(self) -> int:
        """Return the number of placements."""
        return math.prod(self.shape)

    def lane(self, scale: int, row: int, column: int) -> int | None:
        """Return the lane of a placement, None if it is not in the range."""
        scales, rows, columns = self.shape
        scale, row, column = scale - self.first[0], row - self.first[1], column - self.first[2]
        if not (0 <= scale < scales and 0 <= row < rows and 0 <= column < columns):
            return None
        return (scale * rows + row) * columns + column

    def place(self, lane: int) -> Place:
        """Return the placement of a lane."""
        scale, rest = divmod(lane, self.shape[1] * self.shape[2])
        row, column = divmod(rest, self.shape[2])
        return self.first[0] + scale, self.first[1] + row, self.first[2] + column

    def about(self, place: Place, reach: Place) -> SearchRange:
        """
        Return the part of this range about a placement, of the same size wherever that is.

        :param reach: how many placements to either side it has, as far as there are as many.
        """
        shape = tuple(min(2 * r + 1, n) for r, n in zip(reach, self.shape, strict=True))
        first = tuple(
            min(max(at - r, start), start + whole - part)
            for at, r, start, whole, part in zip(
                place, reach, self.first, self.shape, shape, strict=True
            )
        )
        return SearchRange((first[0], first[1], first[2]), (shape[0], shape[1], shape[2]))


@dataclass(frozen=True)
class Sampled:
    """
    The likelihood about one box on the pixel grid of the templates.

    ``images`` is (S, height, width) uint8, one padded image for each body height, black where
    nothing is known.  ``known`` is the same with 255 where something is known, None if that is
    everywhere.
    """

    images: NDArray[np.uint8]
    known: NDArray[np.uint8] | None


class PlacementGrid:
    """
    Shifts and body heights searched about the centre of a box.

    Shifts are whole pixels of the template grid, so that shifted templates are windows of one
    resampled image for each body height.  All shifts are relative to the box and in units of
    the body height in question.
    """

    def __init__(self, grid: tuple[int, int], fill: float, config: MatchingConfig) -> None:
        """
        Lay out the placements.

        :param grid: (H, W) of the templates.
        :param fill: share of the rows the body takes.
        """
        self._fill = fill
        self.body = fill * grid[0]
        """Height of a body on the pixel grid of the templates."""

        step = max(1, round(config.shift_step * self.body))
        self.shift = step / self.body
        """Distance of neighbouring shifts in body heights."""

        self.center: Place = (config.scales, config.shifts_y, config.shifts_x)
        """The box's own height and centre."""

        shape = (2 * config.scales + 1, 2 * config.shifts_y + 1, 2 * config.shifts_x + 1)
        self.everywhere = SearchRange((0, 0, 0), shape)
        self.windows = WindowGrid(*grid, *shape[1:], step)
        self._log_step = math.log1p(config.scale_step)
        steps = np.arange(-config.scales, config.scales + 1)
        self.scales: NDArray[np.float64] = np.exp(steps * self._log_step)
        """Body heights over that of the box."""

    def placement(self, scale: float, row: float, column: float, angle: float = 0.0) -> Placement:
        """
        Return the placement with an index, which may lie between whole numbers.

        :param angle: tilt of the body's axis in radians, along and across which shifts go.
        """
        factor = math.exp((scale - self.center[0]) * self._log_step)
        across = (column - self.center[2]) * self.shift * factor
        along = (row - self.center[1]) * self.shift * factor
        cos, sin = math.cos(angle), math.sin(angle)
        return Placement(cos * across - sin * along, sin * across + cos * along, factor)

    def sample(
        self,
        likelihood: NDArray[np.uint8],
        known: NDArray[np.uint8] | None,
        box: Box,
        blur: int,
        angle: float = 0.0,
        searched: slice = _EVERY_HEIGHT,
    ) -> Sampled:
        """
        Resample a likelihood for all placements about a box.

        :param likelihood: (h, w) uint8.
        :param known: (h, w) uint8, 0 where the likelihood says nothing; None = known everywhere.
        :param box: the box in the likelihood's pixels.
        :param blur: side of the box filter before resampling; larger where resampling shrinks,
            so that nothing aliases.
        :param angle: tilt of the body's axis in radians.
        :param searched: the body heights that are wanted; the images of others are black.
        """
        rows, columns = self.windows.image_shape
        pitch = box.height * float(self.scales[-1]) / self.body
        wanted = range(len(self.scales))[searched]
        grids = [self.transform(box, scale, angle) for scale in wanted]
        side = max(blur, antialiasing_side(pitch))
        images = np.zeros((len(self.scales), rows, columns), np.uint8)
        images[searched], seen = resampled(likelihood, known, grids, (columns, rows), side)
        if seen is None:
            return Sampled(images, None)
        masks = np.zeros_like(images)
        masks[searched] = seen
        return Sampled(images, masks)

    def transform(self, box: Box, scale: int, angle: float) -> NDArray[np.float64]:
        """Return the transform from the padded image of a body height to where the box is."""
        height = box.height * float(self.scales[scale])
        body = BodyFrame(box.center_x, box.center_y, height, angle)
        rows, columns = self.windows.image_shape
        result = template_to_image(body, self.windows.height, self.windows.width, self._fill)
        middle = (self.windows.width - columns) / 2, (self.windows.height - rows) / 2
        result[:, 2] += result[:, :2] @ middle
        return result
