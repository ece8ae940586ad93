# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Silhouettes of the walking body, anti-aliased, in the frame of the template bank.

Registration: one scale and one position for a whole cycle.  The top and the bottom of the body,
each averaged over the cycle, span its height; the median columns, averaged over the cycle, are
its axis.  Within the cycle the head therefore rises and falls as it does in life (about 2 % of
the height) while the ground stays where it is.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gait_segmentation.errors import BankError
from gait_segmentation.gait_model.body import make_body
from gait_segmentation.gait_model.build import Build, named_build
from gait_segmentation.gait_model.projection import extent, project
from gait_segmentation.gait_model.raster import draw
from gait_segmentation.gait_model.skeleton import walk
from gait_segmentation.gait_model.solid import PARTS, Body

__all__ = ['Registration', 'register', 'render_cycle', 'render_parts', 'render_silhouette']

_SUPERSAMPLE = 4
_CYCLE = 30  # phases over which a view is registered
_PROBE = 160  # rows of the drawings from which the median column is taken


@dataclass(frozen=True)
class Registration:
    """
    The body's frame in the projection plane, in statures (x to the right, y down).

    ``center_x`` is the axis, ``center_y`` the middle between top and bottom, ``height`` their
    distance.
    """

    center_x: float
    center_y: float
    height: float


def body_at(phases: ArrayLike, build: Build) -> Body:
    """Return the body of a build at (P,) phases."""
    pose = walk(
        phases,
        speed=build.speed,
        arm_swing=build.arm_swing,
        arm_balance=build.arm_balance,
        lean=build.lean,
        twist=build.twist,
        shoe=build.shoe,
    )
    return make_body(pose, build)


@functools.lru_cache(maxsize=512)
def register(build: Build, azimuth: float, elevation: float = 0.0) -> Registration:
    """
    Find the frame of a walker seen from one direction.

    :param build: figure, clothes and way of walking.
    :param azimuth: walking direction, radians.
    :param elevation: how far the camera looks down, radians.
    """
    body = body_at(np.arange(_CYCLE) / _CYCLE, build)
    centers, axes, _ = project(body, azimuth, elevation)
    left, top, right, bottom = extent(centers, axes)
    height = float(bottom.mean() - top.mean())
    step = height / _PROBE
    x0, y0 = float(left.min()), float(top.min())
    shape = (
        math.ceil((bottom.max() - y0) / step) + 1,
        math.ceil((right.max() - x0) / step) + 1,
    )
    ones = np.ones(len(body.pieces), dtype=np.uint8)
    medians = []
    for phase in range(_CYCLE):
        canvas = np.zeros(shape, dtype=np.uint8)
        draw(canvas, (centers[phase] - (x0, y0)) / step, axes[phase] / step, body.pieces, ones)
        mass = np.cumsum(canvas.sum(axis=0, dtype=np.float64))
        medians.append(float(np.interp(mass[-1] / 2, mass, np.arange(1, len(mass) + 1))))
    return Registration(
        x0 + step * float(np.mean(medians)), float(top.mean() + bottom.mean()) / 2, height
    )


def _labels(
    body: Body,
    phase: int,
    place: Registration,
    view: tuple[float, float],
    grid: tuple[int, int],
    scale: float,
    shift: tuple[float, float],
    by_part: bool,
) -> NDArray[np.uint8]:
    """Draw one phase on the supersampled grid; labels are 1, or 1 + the part nearest to us."""
    centers, axes, away = project(body, *view)
    factor = scale * _SUPERSAMPLE
    origin = np.array([place.center_x, place.center_y])
    middle = np.array([grid[1] / 2 + shift[0], grid[0] / 2 + shift[1]]) * _SUPERSAMPLE
    where = (centers[phase] - origin) * factor + middle
    canvas = np.zeros((grid[0] * _SUPERSAMPLE, grid[1] * _SUPERSAMPLE), dtype=np.uint8)
    pieces, labels = body.pieces, np.ones(len(body.pieces), dtype=np.uint8)
    if by_part:
        # Painter's order: the farthest piece first.
        depth = [float(away[phase, list(piece)].mean()) for piece in pieces]
        order = np.argsort(depth, kind='stable')[::-1]
        labels = np.array([1 + body.parts[k] for k in order], dtype=np.uint8)
        pieces = tuple(pieces[k] for k in order)
    draw(canvas, where, axes[phase] * factor, pieces, labels)
    return canvas


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
    build: str | Build = 'average',
    elevation: float = 0.0,
    grid: tuple[int, int] = (96, 64),
    fill: float = 0.9,
) -> NDArray[np.uint8]:
    """
    Draw the silhouettes of several phases of one view on a template grid.

    :param phases: (P,) phases in cycles, 0 = heel contact of the right leg.
    :param azimuth: walking direction in radians: 0 to the right in the image, pi/2 away from the
        camera, pi to the left, -pi/2 towards the camera.
    :param build: a name of :data:`~gait_segmentation.gait_model.build.BUILDS`, or a build.
    :param elevation: how far the camera looks down, radians.
    :param grid: rows and columns.
    :param fill: share of the rows the body takes.
    :returns: (P, rows, columns) uint8, 255 inside, soft edge.
    :raises BankError: for an unknown build.
    """
    figure = named_build(build)
    place = register(figure, float(azimuth), float(elevation))
    body = body_at(phases, figure)
    scale = fill * grid[0] / place.height
    count = len(body.centers)
    result = np.empty((count, *grid), dtype=np.uint8)
    for phase in range(count):
        result[phase] = _coverage(
            _labels(
                body, phase, place, (azimuth, elevation), grid, scale, (0.0, 0.0), False
            ).astype(bool)
        )
    return result


def _canvas(
    phase: float,
    azimuth: float,
    height_px: float,
    build: str | Build,
    elevation: float,
    fill: float,
    shift: tuple[float, float],
    by_part: bool,
) -> NDArray[np.uint8]:
    if not (math.isfinite(height_px) and height_px > 0):
        raise BankError(f'height_px must be a positive number of pixels, got {height_px!r}')
    if not 0 < fill <= 1:
        raise BankError(f'fill must be in (0, 1], got {fill!r}')
    figure = named_build(build)
    place = register(figure, float(azimuth), float(elevation))
    rows = 2 * math.ceil(height_px / fill / 2)
    columns = 2 * math.ceil(height_px * 0.4)
    return _labels(
        body_at([phase], figure),
        0,
        place,
        (azimuth, elevation),
        (rows, columns),
        height_px / place.height,
        shift,
        by_part,
    )


def render_silhouette(
    phase: float,
    azimuth: float,
    height_px: float,
    *,
    build: str | Build = 'average',
    elevation: float = 0.0,
    fill: float = 0.9,
    shift: tuple[float, float] = (0.0, 0.0),
) -> NDArray[np.uint8]:
    """
    Draw one walker of a given size as an anti-aliased alpha channel.

    :param phase: phase in cycles, 0 = heel contact of the right leg.
    :param azimuth: walking direction in radians, as in :func:`render_cycle`.
    :param height_px: height of the body in pixels, averaged over the cycle.
    :param build: a name of :data:`~gait_segmentation.gait_model.build.BUILDS`, or a build.
    :param elevation: how far the camera looks down, radians.
    :param fill: share of the image's rows the body takes.
    :param shift: (right, down) displacement in pixels, for positions between pixels.
    :returns: (rows, columns) uint8, both even: about ``height_px / fill`` rows and
        ``0.8 * height_px`` columns.  The body's axis is the middle column, the ground (without
        ``shift`` and elevation) is ``height_px / 2`` below the middle row at every phase.
    :raises BankError: for an unknown build or a size that is not positive.
    """
    labels = _canvas(phase, azimuth, height_px, build, elevation, fill, shift, False)
    return _coverage(labels.astype(bool))


def render_parts(
    phase: float,
    azimuth: float,
    height_px: float,
    *,
    build: str | Build = 'average',
    elevation: float = 0.0,
    fill: float = 0.9,
    shift: tuple[float, float] = (0.0, 0.0),
) -> dict[str, NDArray[np.uint8]]:
    """
    Draw the visible share of every part of the body, for painting clothes.

    Parameters, size and registration are those of :func:`render_silhouette`.

    :returns: part -> (rows, columns) uint8 alpha, for all of
        :data:`~gait_segmentation.gait_model.solid.PARTS`; the alphas of a pixel add up to that of
        the silhouette, but for rounding.
    :raises BankError: for an unknown build or a size that is not positive.
    """
    labels = _canvas(phase, azimuth, height_px, build, elevation, fill, shift, True)
    return {name: _coverage(labels == 1 + index) for index, name in enumerate(PARTS)}
