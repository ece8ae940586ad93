# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Placements of templates about a box, and the likelihood resampled for them.

Also the way back: templates and boxes in the pixels of the image.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import (
    BodyFrame,
    Box,
    Placement,
    pixel_affine,
    reach,
    template_to_image,
)
from gait_segmentation.matching.config import MatchingConfig

LANES = 160
"""
Windows that are treated at a time, to a multiple of which rows of results are filled up: an
ordinary search has 147.
"""

_ALL = 255
# How far from the template the person may reach, in body heights: clothes, bags, hands.
_REACH = 0.12
_LIKELY = 190  # likelihood from which on pixels are taken for the person's
_LEAST_LENGTH = 0.02  # length of a row or column of them that is more than noise, in body heights

Place = tuple[int, int, int]
"""Body height, row and column of a placement."""


@dataclass(frozen=True)
class SearchRange:
    """
    A box of placements: body heights, rows and columns from ``first`` on, ``shape`` of each.

    Placements in it have *lanes*, columns running fastest: ``size`` of them, and ``pitch`` when
    they are filled up to a multiple of :data:`LANES`.
    """

    first: Place
    shape: Place

    @cached_property
    def slices(self) -> tuple[slice, slice, slice]:
        """Return the body heights, rows and columns."""
        heights, rows, columns = map(slice, self.first, np.add(self.first, self.shape).tolist())
        return heights, rows, columns

    @cached_property
    def size(self) -> int:
        """Return the number of placements."""
        return math.prod(self.shape)

    @cached_property
    def pitch(self) -> int:
        """Return the number of lanes with filling."""
        return -(-self.size // LANES) * LANES

    def place(self, lane: int) -> Place:
        """Return the placement of a lane."""
        scale, rest = divmod(lane, self.shape[1] * self.shape[2])
        row, column = divmod(rest, self.shape[2])
        return self.first[0] + scale, self.first[1] + row, self.first[2] + column

    def about(self, place: Place, reach: Place) -> SearchRange:
        """Return the part up to ``reach`` about a placement, of the same size wherever that is."""
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


@dataclass(frozen=True)
class WindowGrid:
    """``rows`` x ``columns`` windows of ``height`` x ``width`` pixels, ``step`` pixels apart."""

    height: int
    width: int
    rows: int
    columns: int
    step: int = 1

    @cached_property
    def image_shape(self) -> tuple[int, int]:
        """Return the (height, width) of a padded image."""
        return (
            self.height + (self.rows - 1) * self.step,
            self.width + (self.columns - 1) * self.step,
        )

    def part(self, row: int, column: int) -> tuple[slice, slice]:
        """Return the rows and columns of a padded image that a window has."""
        top, left = row * self.step, column * self.step
        return slice(top, top + self.height), slice(left, left + self.width)

    def areas(self, images: NDArray[np.uint8]) -> NDArray[np.int32]:
        """Sum up (S, *self.image_shape) uint8 over all windows: (S, rows, columns) int32."""
        sums = np.stack([cv2.integral(image) for image in images])
        rows = self.step * np.arange(self.rows)[:, None]
        columns = self.step * np.arange(self.columns)
        below, right = rows + self.height, columns + self.width
        return np.asarray(
            sums[:, below, right]
            - sums[:, below, columns]
            - sums[:, rows, right]
            + sums[:, rows, columns]
        )


class PlacementGrid:
    """
    Shifts and body heights searched about the centre of a box.

    Shifts are whole pixels of the template grid, so that shifted templates are windows of one
    resampled image for each body height.  All shifts are relative to the box and in units of
    the body height in question.
    """

    def __init__(self, grid: tuple[int, int], fill: float, config: MatchingConfig) -> None:
        """Lay out placements for an (H, W) grid, of whose rows a body takes the share ``fill``."""
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
        """Return a placement, also between whole numbers, whose shifts are tilted by radians."""
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
        angle: float,
        searched: slice,
    ) -> Sampled:
        """
        Resample a likelihood for all placements about a box.

        :param likelihood: and ``known`` as for :func:`resampled`.
        :param box: the box in the likelihood's pixels.
        :param blur: side of the box filter before resampling; larger where resampling shrinks,
            so that nothing aliases.
        :param angle: tilt of the body's axis in radians.
        :param searched: the body heights that are wanted; the images of others are black.
        """
        side = max(blur, antialiasing_side(box.height * float(self.scales[-1]) / self.body))
        body = BodyFrame(box.center_x, box.center_y, box.height, angle)
        shape = self.windows.image_shape
        images = np.zeros((len(self.scales), *shape), np.uint8)
        grids = self.scales[searched], shape, self.body
        images[searched], seen = resampled(likelihood, known, body, *grids, side)
        if seen is None:
            return Sampled(images, None)
        masks = np.zeros_like(images)
        masks[searched] = seen
        return Sampled(images, masks)


def antialiasing_side(pitch: float) -> int:
    """Return the odd side of the box filter, in pixels, for samples a pitch of pixels apart."""
    return 2 * math.ceil(pitch / 2 - 0.75) + 1


def resampled(
    likelihood: NDArray[np.uint8],
    known: NDArray[np.uint8] | None,
    body: BodyFrame,
    factors: Sequence[float] | NDArray[np.float64],
    shape: tuple[int, int],
    height: float,
    side: int,
) -> tuple[NDArray[np.uint8], NDArray[np.uint8] | None]:
    """
    Resample a likelihood on upright grids about a body, linearly, after a box filter.

    :param likelihood: (h, w) uint8.
    :param known: (h, w) uint8, 0 where the likelihood says nothing; None = known everywhere.
    :param body: the body in its pixels, which stands in the middle of the grids.
    :param factors: of S grids, ascending, by how much larger the body is than ``body``.
    :param shape: rows and columns of the grids.
    :param height: of the body on each grid, in the grid's pixels.
    :param side: of the box filter, in pixels of the likelihood.
    :returns: (S, rows, columns) uint8, one image for each grid, black where nothing is known, and
        the same with 255 where something is known; None if that is everywhere.
    """
    images = np.zeros((len(factors), *shape), np.uint8)
    larger = np.asarray(factors)[:, None]
    grids = larger[..., None] * template_to_image(body, *shape, height)
    grids[..., 2] += (1 - larger) * (body.center_x, body.center_y)
    area = reach(grids[-1], shape[1], shape[0])
    rows, columns = likelihood.shape
    window = area.slices(columns, rows, side + 1)
    values, seen = likelihood[window], None
    if values.size == 0:
        return images, np.zeros_like(images)
    if known is not None:
        seen = np.where(known[window] != 0, _ALL, 0).astype(np.uint8)
        values = cv2.bitwise_and(values, seen)
    if side > 1:
        # The means of squares over what is known.
        values = cv2.blur(values, (side, side), borderType=cv2.BORDER_REPLICATE)
        if seen is not None:
            share = cv2.blur(seen, (side, side), borderType=cv2.BORDER_REPLICATE)
            values = cv2.divide(values, share, scale=_ALL)
    if seen is None and (min(area.x, area.y) < 0 or area.right > columns or area.bottom > rows):
        seen = np.full(values.shape, _ALL, np.uint8)
    masks = None if seen is None else np.zeros_like(images)
    grids[..., 2] -= window[1].start, window[0].start
    linear, nearest = cv2.INTER_LINEAR, cv2.INTER_NEAREST
    for index, matrix in enumerate(pixel_affine(grids)):
        how = linear | cv2.WARP_INVERSE_MAP, cv2.BORDER_REPLICATE
        cv2.warpAffine(values, matrix, shape[::-1], images[index], *how)
        if seen is not None and masks is not None:
            how = nearest | cv2.WARP_INVERSE_MAP, cv2.BORDER_CONSTANT
            cv2.warpAffine(seen, matrix, shape[::-1], masks[index], *how)
    if masks is None or masks.all():
        return images, None
    return images & masks, masks


def warp_template(
    template: NDArray[np.uint8], body: BodyFrame, fill: float, shape: tuple[int, int]
) -> NDArray[np.uint8]:
    """
    Warp a template to where a body stands.

    Interpolates linearly; where the template shrinks it is averaged over the pixels' areas.

    :param template: (H, W) uint8.
    :param body: where the body stands, in the image's pixels.
    :param fill: share of the template's rows the body takes.
    :param shape: (h, w) of the image.
    :returns: (h, w) uint8, 255 inside, soft edge.
    """
    result = np.zeros(shape, np.uint8)
    height, width = template.shape
    transform = template_to_image(body, height, width, fill * height)
    rows, columns = reach(transform, width, height).slices(shape[1], shape[0])
    size = (columns.stop - columns.start, rows.stop - rows.start)
    if min(size) == 0:
        return result
    finer = max(1, math.ceil(fill * height / body.height - 0.25))
    transform[:, 2] -= columns.start, rows.start
    matrix = pixel_affine(finer * transform)
    warped = cv2.warpAffine(
        template, matrix, (size[0] * finer, size[1] * finer), flags=cv2.INTER_LINEAR
    )
    if finer > 1:
        warped = cv2.resize(warped, size, interpolation=cv2.INTER_AREA)
    result[rows, columns] = warped
    return result


def likely_box(
    image: NDArray[np.uint8],
    template: NDArray[np.uint8],
    place: tuple[slice, slice],
    body: float,
    to_source: NDArray[np.float64],
) -> Box | None:
    """
    Return the box about what is likely where a template stands.

    The template says whose pixels these are, and the likelihood how far they go: people are
    broader than a model, by clothes and what they carry.

    :param image: (h, w) uint8 likelihood.
    :param template: (H, W) uint8, and ``place``, the rows and columns of the image it takes.
    :param body: height of the body in pixels of the image.
    :param to_source: (2, 3) transform from the image to the source.
    :returns: the upright box in source pixels, None if nothing is likely there.
    """
    near = np.zeros(image.shape, np.uint8)
    cv2.threshold(template, 127, 1, cv2.THRESH_BINARY, near[place])
    side = 2 * round(_REACH * body) + 1
    near = cv2.dilate(near, np.ones((side, side), np.uint8))
    inside = (image > _LIKELY) & (near > 0)
    least = _LEAST_LENGTH * body
    inside &= (inside.sum(axis=1) >= least)[:, None]
    inside &= inside.sum(axis=0) >= least
    rows = np.flatnonzero(inside.any(axis=1))
    if not rows.size:
        return None
    # Whichever way the image is turned, nothing reaches farther than an end of a row.
    first, last = inside[rows].argmax(axis=1), inside[rows, ::-1].argmax(axis=1)
    columns = np.concatenate([first, image.shape[1] - 1 - last])
    points = np.column_stack([columns + 0.5, np.tile(rows, 2) + 0.5])
    points = points @ to_source[:, :2].T + to_source[:, 2]
    half = 0.5 * float(np.hypot(*to_source[:, 0]))
    low, high = points.min(axis=0) - half, points.max(axis=0) + half
    return Box(float(low[0]), float(low[1]), *(high - low).tolist())
