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

from gait_segmentation.geometry import Box
from gait_segmentation.results import MatchResult

__all__ = ['Shape', 'measures_of', 'person_box']

_ROWS, _COLUMNS, _FILL = 48, 36, 0.9
_NEAR = 0.06
"""Margin about the template, in body heights."""

_THIN = 0.03
"""Least width of what is taken along beyond the template, and how far it may reach, in heights."""

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
_UPPER, _SHIFT = slice(0, 26), 4
"""Rows by which shapes are registered, and by how many pixels at most."""


@dataclass(frozen=True)
class Shape:
    """
    What moves about a body, in the body's frame.

    ``likelihood`` is (48, 36) uint8, the body upright in 90 % of the rows, ``template`` the same
    of the matched template, ``inside`` 255 where the image shows something; ``plain`` how well an
    ellipse or a rectangle fits the shape, and ``similarity`` that of the template.
    """

    likelihood: NDArray[np.uint8]
    template: NDArray[np.uint8]
    inside: NDArray[np.uint8]
    plain: float
    similarity: float

    @classmethod
    def of(cls, likelihood: NDArray[np.uint8], result: MatchResult) -> Shape:
        """Cut the shape out of a likelihood image, and the template that was matched there."""
        body = result.body
        assert body is not None
        step = body.height / (_FILL * _ROWS)
        matrix = np.array(
            [
                [step, 0, body.center_x - step * _COLUMNS / 2],
                [0, step, body.center_y - step * _ROWS / 2],
            ]
        )
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        part = cv2.warpAffine(likelihood, matrix, (_COLUMNS, _ROWS), flags=flags)
        expected = cv2.warpAffine(result.shape_prior, matrix, (_COLUMNS, _ROWS), flags=flags)
        whole = np.full(likelihood.shape, 255, np.uint8)
        inside = cv2.warpAffine(whole, matrix, (_COLUMNS, _ROWS), flags=flags)
        return cls(part, expected, inside, _plainness(part > 127), result.similarity)


def measures_of(shapes: Sequence[Shape]) -> dict[str, float]:
    """
    Measure how a shape changes over time, seen in the frame of its body.

    :param shapes: of about a third of a second.
    :returns: ``similarity`` with the matched templates; ``plain``, by how much more it is like
        an ellipse or a rectangle; ``swing``, the standard deviation of the pixels of the legs over
        time as a share of their mean area, and ``trunk``, the same of the trunk; ``rigid``, by how
        much the legs are more like those of the other times than like those of the templates,
        with what is beside them or without, whichever is less: a shadow and a companion keep
        their shape, too; ``accord``, the correlation of what changes at the legs with what
        changes there in the templates.
    """
    # What the border hides at times does not move.
    inside = np.min([shape.inside for shape in shapes], axis=0) == 255
    loose = np.stack([shape.likelihood * inside for shape in shapes]).astype(np.float32)
    stack = _registered(loose)
    templates = np.stack([shape.template * inside for shape in shapes]).astype(np.float32)
    mean, spread = stack.mean(axis=0), stack.std(axis=0)
    trunk, legs = (max(float(mean[part].sum()), 255.0) for part in (_TRUNK, _LEGS))
    expected = templates[:, _LEGS]
    # What lies about where some template has legs.
    swath = cv2.dilate((expected.max(axis=0) > 127).astype(np.uint8), _ABOUT)
    similarity = float(np.mean([shape.similarity for shape in shapes]))
    return {
        'similarity': similarity,
        'swing': float(spread[_LEGS].sum()) / legs,
        'trunk': float(spread[_TRUNK].sum()) / trunk,
        'plain': float(np.median([shape.plain for shape in shapes[-3:]])) - similarity,
        'rigid': _rigidity(stack[:, _LEGS], loose[:, _LEGS], expected, swath),
        'accord': _accord(stack[:, _LEGS] * swath, expected),
    }


def _registered(stack: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return shapes shifted so that head and trunk lie as in the last one."""
    last = stack[-1, _UPPER]
    registered = []
    for shape in stack:
        room = cv2.copyMakeBorder(shape, *(4 * (_SHIFT,)), cv2.BORDER_CONSTANT)
        upper = room[_UPPER.start : _UPPER.stop + 2 * _SHIFT]
        off = cv2.matchTemplate(upper, last, cv2.TM_SQDIFF)
        down, across = np.unravel_index(int(off.argmin()), off.shape)
        registered.append(room[down : down + _ROWS, across : across + _COLUMNS])
    return np.stack(registered)


def _rigidity(
    legs: NDArray[np.float32],
    loose: NDArray[np.float32],
    templates: NDArray[np.float32],
    swath: NDArray[np.uint8],
) -> float:
    """
    Return by how much legs are more like those of the other times than like templates.

    Whichever is less, of all that is there or of what lies in the swath.

    :param legs: (n, h, w) float32, registered.
    :param loose: the same where the templates were matched.
    """
    least = math.inf
    for about in (np.ones_like(swath), swath):
        shown = legs * about
        others = (shown.sum(axis=0) - shown) / (len(shown) - 1)
        own = _similarity(loose * about, templates)
        least = min(least, _similarity(shown, others) - own)
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
    moving = likelihood[window] > 127
    if moving.size == 0:
        return None, 0.0
    size = 2 * max(1, round(_NEAR * body.height)) + 1
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    near = cv2.dilate(result.shape_prior[window], kernel) > 127
    found = moving & near
    rows, columns = found.sum(axis=1), found.sum(axis=0)
    if not rows.any():
        return None, 0.0
    top, bottom = _ends(rows, _RIM)
    left, right = _ends(columns, _RIM)
    # Feet and head that the template just misses.
    counts = moving[:, left:right].sum(axis=1)
    least, most = max(1.0, _THIN * body.height), round(_THIN * body.height)
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
