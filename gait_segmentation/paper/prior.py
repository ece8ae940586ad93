# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The oriented shape prior of Wang, Yagi and Makihara (ACCV 2009, section 4), as we read it.

The outline of the matched template is split into oriented templates, one for each word of a
vocabulary over position and orientation, and each has its distance transform.  Where the image
has an edge, the distance is that to the words the edge itself may belong to; elsewhere it is the
distance to the outline, that of Freedman and Zhang (CVPR 2005).  Outside of the template, pixels
where the least of the words' distances is above a threshold are background.  The oriented distance
is lessened by a local search and where the image does not confirm the outline, and enters the
n-links.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import BodyFrame, Box
from gait_segmentation.kernels import kernel
from gait_segmentation.paper.vocabulary import Vocabulary

_SOBEL_GAIN = 8.0  # response of a 3 x 3 Sobel filter to a ramp of one level a pixel
_FLAT = 1.0  # gradients of fewer levels a pixel are noise, also in the dark
# What an edge of a wrong word is further away, in body heights (times paper_orientation).
_WRONG_WORD = 0.03
_CONFIRM_REACH = 0.015  # how near, in body heights, an image edge confirms the outline
_CONFIRM_ANGLE = math.radians(30)  # and how parallel


class EdgePoints(NamedTuple):
    """``rows`` and ``columns``, (n,) int64, and ``orientation``, (n,) float32 in [0, pi)."""

    rows: NDArray[np.int64]
    columns: NDArray[np.int64]
    orientation: NDArray[np.float32]


class Gradient(NamedTuple):
    """
    The gradient of an image and its edges.

    ``orientation`` is (h, w) float32 in [0, pi); ``visible`` (h, w) bool says where the gradient
    is strong enough to have one and ``edges`` (h, w) bool where Canny's edges are.
    """

    orientation: NDArray[np.float32]
    visible: NDArray[np.bool_]
    edges: NDArray[np.bool_]


class ShapeTerms(NamedTuple):
    """
    What the prior makes of a template, step by step.

    All but ``far`` and ``psi`` are of the ``part`` of the window, rows and columns, in which
    something is to be worked out.  ``points`` are the template's outline, ``gradient`` that of the
    image, ``confirmed`` (n,) bool says which points have an edge of the image, ``distance`` is the
    oriented distance, (h', w') float32 in pixels, before the local search.  ``far`` is (h, w)
    bool, what is background by the threshold; ``psi`` (h, w) float32, what a cut costs, 0..1.
    """

    part: tuple[slice, slice]
    points: EdgePoints
    gradient: Gradient
    confirmed: NDArray[np.bool_]
    distance: NDArray[np.float32]
    far: NDArray[np.bool_]
    psi: NDArray[np.float32]


def shape_terms(
    prior: NDArray[np.uint8],
    grey: NDArray[np.uint8],
    body: BodyFrame,
    vocabulary: Vocabulary,
    *,
    reach: float,
    depth: float,
    orientation: float,
    search: float,
    unconfirmed: float,
) -> ShapeTerms | None:
    """
    Work out the prior of a warped template.

    :param prior: (h, w) uint8, the template in the window, 255 inside.
    :param grey: (h, w) uint8, the image in the window.
    :param body: the body in the window's pixels.
    :param reach: and the next four: parameters ``paper_...`` of the segmentation.
    :returns: the steps, None if the template has no outline.
    """
    height = body.height
    inside = prior > 127
    around = Box.around(inside)
    if around is None:
        return None
    search = max(1.0, search * height)
    reach, depth = reach * height, depth * height
    # Further away the cost is saturated.
    margin = search + reach + 2
    part = around.padded(margin, margin).slices(prior.shape[1], prior.shape[0])
    points = silhouette_edges(prior[part], height)
    if points.rows.size == 0:
        return None
    gradient = image_gradient(grey[part])
    distance = oriented_distance(
        vocabulary,
        points,
        gradient,
        body.shifted(-part[1].start, -part[0].start),
        orientation * _WRONG_WORD * height,
        search + max(reach, depth),
    )
    elsewhere = np.ones(distance.shape, np.uint8)
    elsewhere[points.rows, points.columns] = 0
    far = ~inside
    far[part] &= cv2.distanceTransform(elsewhere, cv2.DIST_L2, cv2.DIST_MASK_PRECISE) > reach
    side = 2 * round(search) + 1
    disk = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side))
    near = np.asarray(cv2.erode(distance, disk), np.float32)
    # The middle of a limb is as much inside as that of the trunk.
    near *= np.where(inside[part], np.float32(1 / depth), np.float32(1 / reach))
    np.clip(near, 0, 1, out=near)
    supported = confirmed(points, gradient, max(1.0, _CONFIRM_REACH * height))
    near[~_of_nearest(elsewhere, points, supported)] *= np.float32(unconfirmed)
    psi = np.ones(prior.shape, np.float32)
    psi[part] = near
    return ShapeTerms(part, points, gradient, supported, distance, far, psi)


def oriented_distance(
    vocabulary: Vocabulary,
    points: EdgePoints,
    gradient: Gradient,
    body: BodyFrame,
    penalty: float,
    cap: float,
) -> NDArray[np.float32]:
    """
    Return the distance to the outline, at image edges by the word of the edge.

    At a pixel with a gradient it is min over words w of DT_w + penalty (1 - P(w | z)), DT_w being
    the distance transform of the outline points of word w and P(w | z) the posterior of the word
    at the pixel's position and gradient orientation.  Elsewhere it is the distance transform of
    the whole outline, which is also what the minimum is without a penalty.

    :param vocabulary: the words.
    :param points: the template's outline, at least one point.
    :param gradient: of the image, (h, w).
    :param body: the body in the same pixels.
    :param penalty: what a wrong word adds to the distance, in pixels.
    :param cap: largest distance, in pixels.
    :returns: (h, w) float32 in pixels.
    """
    distances = word_distances(vocabulary, points, gradient.visible.shape, body, cap)
    result = distances.min(axis=0)
    rows, columns = np.nonzero(gradient.visible & (result < np.float32(cap)))
    z = vocabulary.features(columns + 0.5, rows + 0.5, gradient.orientation[rows, columns], body)
    wrong = np.float32(penalty) * (1 - vocabulary.posteriors(z))
    least = (distances[:, rows, columns] + wrong.T).min(axis=0)
    result[rows, columns] = np.minimum(least, np.float32(cap))
    return np.asarray(result)


def word_distances(
    vocabulary: Vocabulary, points: EdgePoints, shape: tuple[int, ...], body: BodyFrame, cap: float
) -> NDArray[np.float32]:
    """
    Return DT_w, the distance transform of the outline points of each word.

    :param shape: h and w of the image.
    :param cap: largest distance, in pixels; all of it where a word has no points.
    :returns: (K, h, w) float32 in pixels.
    """
    squares = np.full((vocabulary.words, *shape), cap * cap, np.float32)
    steps = np.arange(-math.floor(cap), math.floor(cap) + 1, dtype=np.float32)
    words = words_of(vocabulary, points, body)
    _stamp(points.rows, points.columns, words, steps * steps, squares)
    return np.sqrt(squares, out=squares)


def words_of(vocabulary: Vocabulary, points: EdgePoints, body: BodyFrame) -> NDArray[np.int64]:
    """Return the most probable word of each outline point, (n,)."""
    own = vocabulary.features(points.columns + 0.5, points.rows + 0.5, points.orientation, body)
    return vocabulary.nearest(own)


@kernel('i8[:], i8[:], i8[::1], f4[::1], f4[:,:,::1]')
def _stamp(rows, columns, words, table, squares):  # type: ignore[no-untyped-def]
    """Lower squared distances to those from each point: sooner than a transform a word."""
    _, height, width = squares.shape
    reach = table.size // 2
    for index in range(rows.size):
        row, column = rows[index], columns[index]
        first, last = max(column - reach, 0), min(column + reach + 1, width)
        across = table[first - column + reach : last - column + reach]
        for y in range(max(row - reach, 0), min(row + reach + 1, height)):
            line = squares[words[index], y, first:last]
            down = table[y - row + reach]
            for x in range(last - first):
                # No min(): the vectorizer leaves its handling of NaN alone.
                value = across[x] + down
                line[x] = value if value < line[x] else line[x]


def confirmed(points: EdgePoints, gradient: Gradient, reach: float) -> NDArray[np.bool_]:
    """
    Return which outline points have an image edge of their orientation near them, (n,) bool.

    :param reach: how near, in pixels.
    """
    height, width = gradient.edges.shape
    steps = np.arange(-math.floor(reach), math.floor(reach) + 1)
    d_row, d_column = (grid.ravel() for grid in np.meshgrid(steps, steps, indexing='ij'))
    disk = d_row**2 + d_column**2 <= reach**2
    rows = points.rows[:, None] + d_row[disk]
    columns = points.columns[:, None] + d_column[disk]
    there = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
    rows, columns = np.clip(rows, 0, height - 1), np.clip(columns, 0, width - 1)
    there &= gradient.edges[rows, columns]
    turn = np.abs(gradient.orientation[rows, columns] - points.orientation[:, None])
    there &= np.minimum(turn, np.float32(math.pi) - turn) < _CONFIRM_ANGLE
    return np.asarray(there.any(axis=1))


def _of_nearest(
    elsewhere: NDArray[np.uint8], points: EdgePoints, flags: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Give every pixel the flag of the outline point nearest to it, (h, w) bool."""
    _, labels = cv2.distanceTransformWithLabels(
        elsewhere, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    by_label = np.zeros(int(labels.max()) + 1, np.bool_)
    by_label[labels[points.rows, points.columns]] = flags
    return np.asarray(by_label[labels])


def silhouette_edges(silhouette: NDArray[np.uint8], height: float) -> EdgePoints:
    """
    Return the edge points of a silhouette: Canny on the smoothed mask.

    The image's border is no edge of a silhouette that reaches it.

    :param silhouette: (h, w) uint8, 255 inside, soft edge allowed.
    :param height: height of the body in pixels.
    """
    dx, dy = _sobel(silhouette, min(max(0.012 * height, 0.5), 1.5))
    edges = _canny(dx, dy, 15.0, 40.0)
    rows, columns = np.nonzero(edges)
    return EdgePoints(rows, columns, _orientation(dx[rows, columns], dy[rows, columns]))


def image_gradient(grey: NDArray[np.uint8]) -> Gradient:
    """
    Return the gradient of an image, smoothed with a Gaussian of one pixel, and Canny's edges.

    Canny's thresholds are 0.66 and 1.33 times the median grey level, on Sobel's scale; the lower
    one also is that of a visible gradient.

    :param grey: (h, w) uint8.
    """
    dx, dy = _sobel(grey, 1.0)
    counts = np.bincount(grey.ravel(), minlength=256)
    median = int(np.searchsorted(np.cumsum(counts), grey.size / 2)) / _SOBEL_GAIN
    low, high = max(0.66 * median, _FLAT), max(1.33 * median, 2 * _FLAT)
    x, y = dx.astype(np.float32), dy.astype(np.float32)
    visible = x * x + y * y > np.float32((_SOBEL_GAIN * low) ** 2)
    return Gradient(_orientation(dx, dy), visible, _canny(dx, dy, low, high))


def _sobel(image: NDArray[np.uint8], sigma: float) -> tuple[NDArray[np.int16], NDArray[np.int16]]:
    smooth = cv2.GaussianBlur(image, (0, 0), sigma, borderType=cv2.BORDER_REPLICATE)
    dx = cv2.Sobel(smooth, cv2.CV_16S, 1, 0, borderType=cv2.BORDER_REPLICATE)
    dy = cv2.Sobel(smooth, cv2.CV_16S, 0, 1, borderType=cv2.BORDER_REPLICATE)
    return dx, dy


def _canny(
    dx: NDArray[np.int16], dy: NDArray[np.int16], low: float, high: float
) -> NDArray[np.bool_]:
    """Return Canny's edges by thresholds in levels a pixel."""
    low, high = _SOBEL_GAIN * low, _SOBEL_GAIN * high
    return np.asarray(cv2.Canny(dx, dy, low, high, L2gradient=True) > 0)


def _orientation(dx: NDArray[np.int16], dy: NDArray[np.int16]) -> NDArray[np.float32]:
    if dx.size == 0:
        return np.zeros(dx.shape, np.float32)
    # cv2.phase is many times faster than arctan2, and exact to 0.01 degrees.
    angle = cv2.phase(dx.astype(np.float32), dy.astype(np.float32)).reshape(dx.shape)
    half = np.float32(np.pi)
    return np.asarray(np.where(angle >= half, angle - half, angle))
