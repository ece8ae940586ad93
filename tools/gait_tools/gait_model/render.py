# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Silhouettes of the walking body, anti-aliased, in the frame of the template bank.

Registration: one scale and one position for a whole cycle.  The top and the bottom of the body,
each averaged over the cycle, span its height; the median columns, averaged over the cycle, are
its axis.  Within the cycle the head therefore rises and falls as it does in life (about 2 % of
the height) while the ground stays where it is.

Drawing: the outline of a hull of projected ellipsoids is, in every direction, the support of the
member that reaches farthest.  Pixels are set where their centre lies inside, so shapes are neither
grown nor shrunk.
"""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gait_segmentation.errors import BankError
from gait_segmentation.geometry import BodyFrame
from gait_segmentation.kernels import kernel
from gait_tools.gait_model.body import PARTS, Body, Build, body_at, named_build

_SUPERSAMPLE = 4
_CYCLE = 30  # phases over which a view is registered
_PROBE = 160  # rows of the drawings from which the median column is taken
_CORNERS = 96  # of an outline
Array = NDArray[np.float64]
View = tuple[float, float]
"""Azimuth, the walking direction (0 to the right in the image, pi/2 away from the camera, pi to
the left, -pi/2 towards the camera), and elevation, how far the camera looks down; radians."""


def view_matrix(azimuth: float, elevation: float = 0.0) -> Array:
    """Return the (3, 3) matrix from the body's axes to (right, down, away) of the camera."""
    cos_a, sin_a = math.cos(azimuth), math.sin(azimuth)
    cos_e, sin_e = math.cos(elevation), math.sin(elevation)
    level = np.array([[cos_a, -sin_a, 0.0], [sin_a, cos_a, 0.0], [0.0, 0.0, 1.0]])
    tilt = np.array([[1.0, 0.0, 0.0], [0.0, -sin_e, -cos_e], [0.0, cos_e, -sin_e]])
    return tilt @ level


def project(body: Body, view: View) -> tuple[Array, Array, Array]:
    """Return centres (P, E, 2), semi-axes (P, E, 2, 3) and distances (P, E) of ellipsoids."""
    matrix = view_matrix(*view)
    centers = body.centers @ matrix.T
    return centers[..., :2], matrix[:2] @ body.axes, centers[..., 2]


def extent(centers: Array, axes: Array) -> tuple[Array, Array, Array, Array]:
    """Return left, top, right and bottom of projected ellipsoids at every phase, each (P,)."""
    half = np.sqrt((axes**2).sum(axis=-1))
    low, high = (centers - half).min(axis=1), (centers + half).max(axis=1)
    return low[:, 0], low[:, 1], high[:, 0], high[:, 1]


@kernel()
def hull_outline(centers, axes, members, cosine, sine, outline):  # type: ignore[no-untyped-def]
    """
    Write the outline of the hull of some projected ellipsoids.

    :param centers: (E, 2) float64, x and y in pixels.
    :param axes: (E, 2, 3) float64, projected semi-axes as columns.
    :param members: (M,) int64, the ellipsoids of the hull.
    :param cosine: (K,) float64 cosines of K directions in ascending order, and ``sine`` likewise.
    :param outline: (K, 2) float64, written: the convex outline.
    """
    for k in range(len(cosine)):
        best = -1e300
        for member in members:
            reach_x, reach_y, square = 0.0, 0.0, 0.0
            for a in range(3):
                along = axes[member, 0, a] * cosine[k] + axes[member, 1, a] * sine[k]
                reach_x += axes[member, 0, a] * along
                reach_y += axes[member, 1, a] * along
                square += along * along
            reach = math.sqrt(square)
            support = centers[member, 0] * cosine[k] + centers[member, 1] * sine[k] + reach
            if support > best:
                best = support
                scale = 1.0 / max(reach, 1e-12)
                outline[k, 0] = centers[member, 0] + reach_x * scale
                outline[k, 1] = centers[member, 1] + reach_y * scale


@kernel()
def _fill(outline, label, canvas, left, right):  # type: ignore[no-untyped-def]
    """Set the pixels of a convex outline to a label; ``left`` and ``right`` are scratch rows."""
    height, width = canvas.shape
    low, high = outline[:, 1].min(), outline[:, 1].max()
    first = max(math.ceil(low - 0.5), 0)
    last = min(math.ceil(high - 0.5), height)
    for row in range(first, last):
        left[row], right[row] = 1e300, -1e300
    for k in range(len(outline)):
        x0, y0 = outline[k - 1, 0], outline[k - 1, 1]
        x1, y1 = outline[k, 0], outline[k, 1]
        if y0 > y1:
            x0, y0, x1, y1 = x1, y1, x0, y0
        if y1 - y0 < 1e-12:
            continue
        slope = (x1 - x0) / (y1 - y0)
        begin = max(math.ceil(y0 - 0.5), first)
        end = min(math.ceil(y1 - 0.5), last)
        for row in range(begin, end):
            x = x0 + (row + 0.5 - y0) * slope
            left[row], right[row] = min(left[row], x), max(right[row], x)
    for row in range(first, last):
        begin = max(math.ceil(max(left[row], -1.0) - 0.5), 0)
        end = min(math.ceil(min(right[row], width + 1.0) - 0.5), width)
        for column in range(begin, end):
            canvas[row, column] = label


@kernel()
def _draw(centers, axes, members, starts, labels, directions, canvas):  # type: ignore[no-untyped-def]
    angles = 2.0 * math.pi / directions * np.arange(directions)
    cosine, sine = np.cos(angles), np.sin(angles)
    outline = np.empty((directions, 2))
    left, right = np.empty(canvas.shape[0]), np.empty(canvas.shape[0])
    for piece in range(len(labels)):
        span = members[starts[piece] : starts[piece + 1]]
        hull_outline(centers, axes, span, cosine, sine, outline)
        _fill(outline, labels[piece], canvas, left, right)


def draw(
    shape: tuple[int, int],
    centers: Array,
    axes: Array,
    pieces: list[tuple[int, ...]],
    labels: list[int],
) -> NDArray[np.uint8]:
    """Paint hulls of ellipsoids (in pixels) with their labels, later ones over earlier ones."""
    canvas = np.zeros(shape, np.uint8)
    members = np.array([member for piece in pieces for member in piece], dtype=np.int64)
    starts = np.cumsum([0, *(len(piece) for piece in pieces)]).astype(np.int64)
    where, sizes = np.ascontiguousarray(centers), np.ascontiguousarray(axes)
    _draw(where, sizes, members, starts, np.array(labels, np.uint8), _CORNERS, canvas)
    return canvas


def median_column(mask: NDArray[np.uint8]) -> float:
    """Return the column that halves the pixels of a mask, in between two if need be."""
    mass = np.cumsum((mask > 0).sum(axis=0, dtype=np.float64))
    return float(np.interp(mass[-1] / 2, mass, np.arange(1, len(mass) + 1)))


@functools.lru_cache(maxsize=512)
def register(build: Build, view: View) -> BodyFrame:
    """Find the frame of a walker seen from one direction in the projection plane, in statures."""
    body = body_at(np.arange(_CYCLE) / _CYCLE, build)
    centers, axes, _ = project(body, view)
    left, top, right, bottom = extent(centers, axes)
    height = float(bottom.mean() - top.mean())
    step = height / _PROBE
    x0, y0 = float(left.min()), float(top.min())
    shape = (math.ceil((bottom.max() - y0) / step) + 1, math.ceil((right.max() - x0) / step) + 1)
    ones = [1] * len(body.pieces)
    medians = []
    for where, size in zip((centers - (x0, y0)) / step, axes / step, strict=True):
        medians.append(median_column(draw(shape, where, size, body.pieces, ones)))
    axis = x0 + step * float(np.mean(medians))
    return BodyFrame(axis, float(top.mean() + bottom.mean()) / 2, height)


class Drawing:
    """A walker seen from one direction at some phases, and the grid it is drawn on."""

    def __init__(
        self,
        phases: ArrayLike,
        azimuth: float,
        height_px: float,
        *,
        build: str | Build = 'average',
        elevation: float = 0.0,
        grid: tuple[int, int] | None = None,
        fill: float = 0.9,
        shift: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        """
        Place the body.

        :param phases: (P,) phases in cycles, 0 = heel contact of the right leg.
        :param azimuth: see :data:`View`, as ``elevation``.
        :param height_px: height of the body in pixels, averaged over the cycle.
        :param build: a name of :data:`~gait_tools.gait_model.body.BUILDS`, or a build.
        :param grid: rows and columns; if None about ``height_px / fill`` and ``0.8 * height_px``,
            both even.  The body's axis is the middle column, the ground (without ``shift`` and
            elevation) ``height_px / 2`` below the middle row at every phase.
        :param fill: share of the rows the body takes.
        :param shift: (right, down) displacement in pixels, for positions between pixels.
        """
        if not (math.isfinite(height_px) and height_px > 0):
            raise BankError(f'height_px must be a positive number of pixels, got {height_px!r}')
        if not 0 < fill <= 1:
            raise BankError(f'fill must be in (0, 1], got {fill!r}')
        figure, view = named_build(build), (float(azimuth), float(elevation))
        usual = 2 * math.ceil(height_px / fill / 2), 2 * math.ceil(height_px * 0.4)
        rows, columns = grid or usual
        place = register(figure, view)
        self._body = body_at(phases, figure)
        centers, axes, self._away = project(self._body, view)
        factor = height_px / place.height * _SUPERSAMPLE
        middle = np.array([columns / 2 + shift[0], rows / 2 + shift[1]]) * _SUPERSAMPLE
        self._centers = (centers - (place.center_x, place.center_y)) * factor + middle
        self._axes = axes * factor
        self._shape = rows * _SUPERSAMPLE, columns * _SUPERSAMPLE

    def silhouette(self, phase: int = 0) -> NDArray[np.uint8]:
        """Return (rows, columns) uint8 at one of the phases, 255 inside, anti-aliased."""
        pieces = self._body.pieces
        canvas = draw(
            self._shape, self._centers[phase], self._axes[phase], pieces, [1] * len(pieces)
        )
        return _coverage(canvas > 0)

    def parts(self, phase: int = 0) -> dict[str, NDArray[np.uint8]]:
        """Return the visible share of each of :data:`PARTS`, which add up to the silhouette."""
        pieces, parts = self._body.pieces, self._body.parts
        depth = [float(self._away[phase, list(piece)].mean()) for piece in pieces]
        # Painter's order: the farthest piece first.
        order = np.argsort(depth, kind='stable')[::-1].tolist()
        sorted_pieces, labels = [pieces[k] for k in order], [1 + parts[k] for k in order]
        canvas = draw(self._shape, self._centers[phase], self._axes[phase], sorted_pieces, labels)
        return {name: _coverage(canvas == 1 + index) for index, name in enumerate(PARTS)}


def _coverage(inside: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Average supersampled pixels to 0..255."""
    height, width = inside.shape[0] // _SUPERSAMPLE, inside.shape[1] // _SUPERSAMPLE
    blocks = inside.reshape(height, _SUPERSAMPLE, width, _SUPERSAMPLE)
    count = blocks.sum(axis=3, dtype=np.uint8).sum(axis=1, dtype=np.uint16)
    full = _SUPERSAMPLE**2
    return ((count * 255 + full // 2) // full).astype(np.uint8)


def render_cycle(
    phases: ArrayLike,
    azimuth: float,
    *,
    grid: tuple[int, int] = (96, 64),
    fill: float = 0.9,
    **options: Any,
) -> NDArray[np.uint8]:
    """Draw (P, rows, columns) silhouettes on a template grid, see :class:`Drawing`."""
    phases = np.atleast_1d(np.asarray(phases, np.float64))
    drawing = Drawing(phases, azimuth, fill * grid[0], grid=grid, fill=fill, **options)
    return np.stack([drawing.silhouette(index) for index in range(len(phases))])


def render_silhouette(
    phase: float, azimuth: float, height_px: float, **options: Any
) -> NDArray[np.uint8]:
    """Draw one walker of a given size, see :meth:`Drawing.silhouette`."""
    return Drawing([phase], azimuth, height_px, **options).silhouette()


def render_parts(
    phase: float, azimuth: float, height_px: float, **options: Any
) -> dict[str, NDArray[np.uint8]]:
    """Draw the parts of one walker, see :meth:`Drawing.parts`."""
    return Drawing([phase], azimuth, height_px, **options).parts()
