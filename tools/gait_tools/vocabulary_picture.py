# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A picture of a vocabulary: its words, and the words of silhouettes' outlines."""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import BodyFrame, compose, invert, pixel_affine, template_to_image
from gait_segmentation.segmentation.paper_prior import silhouette_edges
from gait_segmentation.segmentation.vocabulary import Vocabulary
from gait_tools.vocabulary_training import Silhouette

__all__ = ['draw_vocabulary']

_ROWS = 384
_GROUND, _BODY = 255, 232


def draw_vocabulary(
    vocabulary: Vocabulary, silhouettes: Sequence[Silhouette]
) -> NDArray[np.uint8]:
    """
    Draw the words beside silhouettes whose outline points have the colours of their words.

    A word is the ellipse of two standard deviations of its position, with a line along its mean
    outline (across the gradient).

    :returns: (rows, columns, 3) uint8 BGR.
    """
    colours = _colours(vocabulary.words)
    panels = [_words(vocabulary, colours)]
    panels += [_outline(vocabulary, silhouette, colours) for silhouette in silhouettes]
    return np.hstack(panels)


def _colours(count: int) -> NDArray[np.uint8]:
    hues = (np.arange(count) * 180 // count).astype(np.uint8)
    values = np.where(np.arange(count) % 2 == 0, 220, 150).astype(np.uint8)
    hsv = np.stack([hues, np.full(count, 230, np.uint8), values], axis=1)
    return np.asarray(cv2.cvtColor(hsv[None], cv2.COLOR_HSV2BGR)[0])


def _grid(vocabulary: Vocabulary) -> tuple[int, int]:
    return _ROWS, round(_ROWS * vocabulary.aspect)


def _words(vocabulary: Vocabulary, colours: NDArray[np.uint8]) -> NDArray[np.uint8]:
    rows, columns = _grid(vocabulary)
    panel = np.full((rows, columns, 3), _GROUND, np.uint8)
    size = np.array([columns, rows])
    for word, colour in enumerate(colours.tolist()):
        middle = vocabulary.means[word, :2] * size
        spread = vocabulary.covariances[word, :2, :2] * np.outer(size, size)
        values, axes = np.linalg.eigh(spread)
        angle = math.degrees(math.atan2(axes[1, 1], axes[0, 1]))
        widths = 2 * np.sqrt(values[::-1])
        center = tuple(np.round(middle).astype(int).tolist())
        lengths = tuple(np.round(widths).astype(int).tolist())
        cv2.ellipse(panel, center, lengths, angle, 0, 360, colour, 1, cv2.LINE_AA)
        theta = math.atan2(vocabulary.means[word, 3], vocabulary.means[word, 2]) / 2
        along = 14 * np.array([-math.sin(theta), math.cos(theta)])
        ends = [tuple(np.round(middle + s * along).astype(int).tolist()) for s in (-1, 1)]
        cv2.line(panel, ends[0], ends[1], colour, 3, cv2.LINE_AA)
    return panel


def _outline(
    vocabulary: Vocabulary, silhouette: Silhouette, colours: NDArray[np.uint8]
) -> NDArray[np.uint8]:
    rows, columns = _grid(vocabulary)
    body = BodyFrame(columns / 2, rows / 2, vocabulary.fill * rows)
    frames = (
        template_to_image(frame, rows, columns, vocabulary.fill)
        for frame in (body, silhouette.body)
    )
    to_panel, to_mask = frames
    motion = pixel_affine(compose(to_panel, invert(to_mask)))
    mask = cv2.warpAffine(silhouette.mask, motion, (columns, rows), flags=cv2.INTER_LINEAR)
    points = silhouette_edges(mask, body.height)
    z = vocabulary.features(points.columns + 0.5, points.rows + 0.5, points.orientation, body)
    panel = np.full((rows, columns, 3), _GROUND, np.uint8)
    panel[mask > 127] = _BODY
    for row, column, word in zip(
        points.rows.tolist(), points.columns.tolist(), vocabulary.nearest(z), strict=True
    ):
        cv2.circle(panel, (column, row), 1, colours[word].tolist(), -1)
    return panel
