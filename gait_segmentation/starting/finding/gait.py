# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a moving shape moves as a walker does: the legs swing and the trunk does not."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import BodyFrame, Box
from gait_segmentation.results import MatchResult

__all__ = ['Gait', 'Shape', 'gait_of', 'person_box']

_ROWS, _COLUMNS, _FILL = 48, 36, 0.9
_NEAR = 0.06
"""Margin about the template, in body heights."""

_THIN, _BEYOND = 0.03, 0.03
"""Least width of what is taken along beyond the template, and how far that goes, in heights."""

_RIM = 0.003
"""Share of the pixels left out at each side of a person's box."""

_TRIM = 0.03
"""The same of the box that a shape is compared with."""

_REACH_X, _REACH_Y = 0.35, 0.75
"""How far about the body what moves ought to belong to it, in body heights."""

_LEAST_AREA = 8
_ABOUT = np.ones((5, 5), np.uint8)
"""What lies about a template: up to two pixels of a shape beside it."""

_PLACE_Y, _PLACE_X = np.ogrid[:_ROWS, :_COLUMNS]
_TRUNK, _LEGS = slice(10, 24), slice(27, 46)


@dataclass(frozen=True)
class Gait:
    """
    How a shape changes over time, seen in the frame of its body.

    ``swing`` is the standard deviation of the pixels of the legs over time, as a share of the
    legs' mean area, ``trunk`` the same of the trunk.  ``legs`` is the area of the legs over that
    of the trunk, ``plain`` the overlap of a shape with an ellipse or a rectangle, whichever fits
    better.  ``rigid`` is by how much the legs are more like those of the other times than like
    those of the matched templates, as Tanimoto similarities, with what is beside them or without,
    whichever is less: a shadow and a companion keep their shape, too.

    ``steps`` is the swing of the legs of the matched templates, ``accord`` the correlation of what
    changes at the legs with what changes there in the templates.  ``sway`` is how much of
    ``trunk`` goes with the templates: the same correlation of the trunk, times ``trunk``.
    """

    swing: float
    trunk: float
    legs: float
    plain: float
    rigid: float
    steps: float
    accord: float
    sway: float


@dataclass(frozen=True)
class Shape:
    """
    What moves about a body, in the body's frame.

    ``likelihood`` is (48, 36) uint8, the body upright in 90 % of the rows, ``template`` the same
    of the matched template; ``plain`` how well an ellipse or a rectangle fits the shape.
    """

    likelihood: NDArray[np.uint8]
    template: NDArray[np.uint8]
    plain: float

    @classmethod
    def of(
        cls, likelihood: NDArray[np.uint8], template: NDArray[np.uint8], body: BodyFrame
    ) -> Shape:
        """Cut the shape out of a likelihood image, and the template out of another one."""
        step = body.height / (_FILL * _ROWS)
        matrix = np.array(
            [
                [step, 0, body.center_x - step * _COLUMNS / 2],
                [0, step, body.center_y - step * _ROWS / 2],
            ]
        )
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        part = cv2.warpAffine(likelihood, matrix, (_COLUMNS, _ROWS), flags=flags)
        expected = cv2.warpAffine(template, matrix, (_COLUMNS, _ROWS), flags=flags)
        return cls(part, expected, _plainness(part > 127))


def gait_of(shapes: Sequence[Shape]) -> Gait:
    """
    Measure the gait.

    :param shapes: of about half a second.
    """
    stack = np.stack([shape.likelihood for shape in shapes]).astype(np.float32)
    mean, spread = stack.mean(axis=0), stack.std(axis=0)
    trunk, legs = float(mean[_TRUNK].sum()), float(mean[_LEGS].sum())
    templates = np.stack([shape.template for shape in shapes]).astype(np.float32)
    expected = templates[:, _LEGS]
    # What lies about where some template has legs.
    swath = cv2.dilate((expected.max(axis=0) > 127).astype(np.uint8), _ABOUT)
    change = float(spread[_TRUNK].sum()) / max(trunk, 255.0)
    return Gait(
        float(spread[_LEGS].sum()) / max(legs, 255.0),
        change,
        legs / max(trunk, 255.0),
        float(np.median([shape.plain for shape in shapes[-3:]])),
        _rigidity(stack[:, _LEGS], expected, swath),
        float(expected.std(axis=0).sum()) / max(float(expected.mean(axis=0).sum()), 255.0),
        _accord(stack[:, _LEGS] * swath, expected),
        change * _accord(stack[:, _TRUNK], templates[:, _TRUNK]),
    )


def _rigidity(
    legs: NDArray[np.float32], templates: NDArray[np.float32], swath: NDArray[np.uint8]
) -> float:
    """
    Return by how much legs are more like those of the other times than like templates.

    Whichever is less, of all that is there or of what lies in the swath.
    """
    if len(legs) < 2:
        return 0.0
    least = math.inf
    for shown in (legs, legs * swath):
        others = (shown.sum(axis=0) - shown) / (len(shown) - 1)
        least = min(least, _similarity(shown, others) - _similarity(shown, templates))
    return least


def _accord(shown: NDArray[np.float32], templates: NDArray[np.float32]) -> float:
    """Return how well what changes over time correlates with what changes in templates."""
    shown, templates = shown - shown.mean(axis=0), templates - templates.mean(axis=0)
    scale = math.sqrt(float((shown**2).sum()) * float((templates**2).sum()))
    return float((shown * templates).sum()) / max(scale, 1.0)


def _similarity(shapes: NDArray[np.float32], others: NDArray[np.float32]) -> float:
    """Return the mean Tanimoto similarity of pairs of (n, h, w) images."""
    both = (shapes * others).sum(axis=(1, 2))
    either = (shapes**2).sum(axis=(1, 2)) + (others**2).sum(axis=(1, 2)) - both
    return float((both / np.maximum(either, 1.0)).mean())


def _plainness(found: NDArray[np.bool_]) -> float:
    """Return the overlap of a shape with the ellipse of its moments or its trimmed box."""
    moments = cv2.moments(found.astype(np.uint8), True)
    area = moments['m00']
    if area < _LEAST_AREA:
        return 0.0
    dx = _PLACE_X - moments['m10'] / area
    dy = _PLACE_Y - moments['m01'] / area
    xx, xy, yy = (moments[name] / area + 1e-3 for name in ('mu20', 'mu11', 'mu02'))
    # Within two standard deviations, which is where a filled ellipse ends.
    inside = yy * dx * dx - 2 * xy * dx * dy + xx * dy * dy < 4 * (xx * yy - xy * xy)
    ellipse = float((inside & found).sum() / (inside | found).sum())
    top, bottom = _ends(found.sum(axis=1), _TRIM)
    left, right = _ends(found.sum(axis=0), _TRIM)
    boxed = float(found[top:bottom, left:right].mean())
    return max(ellipse, boxed)


def person_box(likelihood: NDArray[np.uint8], result: MatchResult) -> tuple[Box | None, float]:
    """
    Return the tight box of a person at the place of the matched template.

    :returns: the box, None if nothing is there, and the share of what moves thereabouts that the
        template covers.
    """
    body = result.body
    if body is None:
        return None, 0.0
    height, width = likelihood.shape
    window = Box.from_center(
        body.center_x, body.center_y, 2 * _REACH_X * body.height, 2 * _REACH_Y * body.height
    ).slices(width, height)
    size = 2 * max(1, round(_NEAR * body.height)) + 1
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    near = cv2.dilate(result.shape_prior[window], kernel) > 127
    moving = likelihood[window] > 127
    found = moving & near
    rows, columns = found.sum(axis=1), found.sum(axis=0)
    if not rows.any():
        return None, 0.0
    top, bottom = _ends(rows, _RIM)
    left, right = _ends(columns, _RIM)
    # Feet and head that the template just misses.
    counts = moving[:, left:right].sum(axis=1)
    least, most = max(1.0, _THIN * body.height), round(_BEYOND * body.height)
    top -= _run(counts[:top][::-1], least, most)
    bottom += _run(counts[bottom:], least, most)
    box = Box(left, top, right - left, bottom - top)
    box = box.shifted(window[1].start, window[0].start)
    return box, float(rows.sum()) / float(moving.sum())


def _run(counts: NDArray[np.int64], least: float, most: int) -> int:
    """Return how many of the first entries in a row reach a least value."""
    short = np.flatnonzero(counts[:most] < least)
    return int(short[0]) if short.size else min(most, len(counts))


def _ends(counts: NDArray[np.int64], trim: float) -> tuple[int, int]:
    """Return from where to where the entries go, without a share at either end."""
    total = np.cumsum(counts)
    first = int(np.searchsorted(total, trim * total[-1], side='right'))
    last = int(np.searchsorted(total, (1 - trim) * total[-1], side='left'))
    return first, last + 1
