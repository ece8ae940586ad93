# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Hypotheses about a first box: templates stretched onto it, one for each direction of walking."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.geometry import BodyFrame, Box
from gait_segmentation.images import Window, bounding_box, tanimoto
from gait_segmentation.kernels import kernel

VIEWS = (0.0, np.pi / 4, np.pi / 2, 3 * np.pi / 4, np.pi)
"""Directions of walking; towards and away from the camera look the same to a silhouette."""

_ANISOTROPY = 0.35  # most stretch in one direction against the other, as a logarithm
# Spread of a box's aspect about that of its template, as a logarithm: of a whole body, and of one
# that the upper or lower border of the image cuts.
_ASPECT_SIGMA = 0.32
_CUT_SIGMA = 0.64
# Templates whose aspect is this much less likely than the best one's are left out.
_NEGLIGIBLE = 0.02
# Most that a body may be broader than its box, as a logarithm, at a side of the image.
_MOST_BEYOND = 1.2
# Bodies tried that reach beyond the border of the image, in heights of the box.
_TALLER = (1.0, 1.4, 2.0, 2.8)
_BLUR_PX = 0.7  # of averaged templates


@dataclass(frozen=True)
class Hypothesis:
    """
    All templates of one direction and tilt (radians, positive to the right) laid onto a box.

    ``templates`` is (K, h, w) uint8 in the rows and columns ``part`` of the window, beyond which
    they are zero, ``weight`` (K,) float32 their prior weight by aspect, ``axis`` (K,) float32 the
    x of the body's axis in the window, ``top`` (K,) float32 its upper end and ``height`` (K,)
    float32 the body's height, all in pixels.
    """

    view: float
    angle: float
    part: Window
    templates: NDArray[np.uint8]
    weight: NDArray[np.float32]
    axis: NDArray[np.float32]
    top: NDArray[np.float32]
    height: NDArray[np.float32]

    def similarities(self, likelihood: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return the Tanimoto similarity of a likelihood with each template, (K,), 0 to 1."""
        image = np.round(likelihood * 255).astype(np.uint8)
        part = image[self.part]
        beyond = int(image.sum(dtype=np.int64)) - int(part.sum(dtype=np.int64))
        return tanimoto(self.templates, part, beyond)

    def body(self, template: int) -> BodyFrame:
        """Return the body frame of a template in the window."""
        height = float(self.height[template])
        middle = float(self.top[template]) + height / 2
        return BodyFrame(float(self.axis[template]), middle, height, self.angle)

    def average(self, weights: NDArray[np.float32], shape: tuple[int, int]) -> NDArray[np.float32]:
        """Return the mean of the templates by (K,) float32, blurred, (h, w) float32 in 0..1."""
        share = (weights / max(float(weights.sum()), 1e-12) / 255).astype(np.float32)
        part, mean = np.zeros(self.templates.shape[1:], np.float32), np.zeros(shape, np.float32)
        _add_weighted(self.templates, share, part)
        mean[self.part] = part
        return np.asarray(cv2.GaussianBlur(mean, (0, 0), _BLUR_PX))


@kernel('u1[:,:,::1], f4[::1], f4[:,::1]')
def _add_weighted(
    templates: NDArray[np.uint8], share: NDArray[np.float32], mean: NDArray[np.float32]
) -> None:
    for k in range(templates.shape[0]):
        if share[k] > 1e-6:
            for row in range(mean.shape[0]):
                for col in range(mean.shape[1]):
                    mean[row, col] += share[k] * np.float32(templates[k, row, col])


def lay_onto(
    box: Box,
    bank: TemplateBank,
    shape: tuple[int, int],
    cuts: tuple[bool, bool, bool, bool],
    view: float,
    angle: float = 0.0,
    taller: float = 1.0,
    aside: float = 0.0,
) -> Hypothesis:
    """
    Lay the templates of a direction onto a box, extents on extents.

    :param box: the tight box of the person in a window of ``shape`` (h, w).
    :param cuts: whether the box ends at the upper, lower, left and right border of the image, so
        that the body may reach beyond.
    :param view: the direction of walking, and ``angle`` the tilt of the body, in radians.
    :param taller: height of the body in heights of the box, which is of its upper part, if no
        border cuts it.
    :param aside: where the body stands in a box that is broader: -1 left, 0 middle, 1 right.
    """
    laid, tight, whole = _templates_of(bank, view, angle)
    which, factor, wide, weight = _likely(box, tight[:, 2] / tight[:, 3], cuts, taller)
    cut_top, cut_bottom, cut_left, _ = cuts
    x, y, width, height = tight[which].T
    tall = box.height * factor
    top = box.y + box.height - tall if cut_top and not cut_bottom else np.full(len(tall), box.y)
    scale_y = tall / height
    stretch = np.log(box.width / width / scale_y)
    scale_x = scale_y * np.where(wide, 1, np.exp(np.clip(stretch, -_ANISOTROPY, _ANISOTROPY)))
    room = np.maximum(box.width - scale_x * width, 0) / 2
    left = box.center_x - scale_x * (x + width / 2) + aside * room
    ahead = box.right - scale_x * (x + width) if cut_left else box.x - scale_x * x
    left = np.where(wide, ahead, left)
    # As geometry.pixel_affine does it, for all templates at once.
    shift_x = left + (scale_x - 1) / 2
    shift_y = top - scale_y * y + (scale_y - 1) / 2
    columns = _span(whole[which, 0::2], scale_x, shift_x, shape[1])
    rows = _span(whole[which, 1::2], scale_y, shift_y, shape[0])
    size = (columns.stop - columns.start, rows.stop - rows.start)
    templates = np.empty((len(which), size[1], size[0]), np.uint8)
    matrix = np.zeros((2, 3))
    for index, template in enumerate(which):
        matrix[0, 0], matrix[0, 2] = scale_x[index], shift_x[index] - columns.start
        matrix[1, 1], matrix[1, 2] = scale_y[index], shift_y[index] - rows.start
        cv2.warpAffine(laid[template], matrix, size, templates[index], cv2.INTER_LINEAR)
    body = scale_y * bank.fill * bank.grid[0]
    grid_height, grid_width = laid[0].shape
    middle = top + scale_y * (grid_height / 2 - y)
    return Hypothesis(
        view,
        angle,
        (rows, columns),
        templates,
        weight.astype(np.float32),
        (left + scale_x * grid_width / 2).astype(np.float32),
        (middle - body / 2 if angle else top).astype(np.float32),
        body.astype(np.float32),
    )


def _templates_of(
    bank: TemplateBank, view: float, angle: float
) -> tuple[list[NDArray[np.uint8]], NDArray[np.int32], NDArray[np.int32]]:
    """Return the templates of a direction, tilted, and the boxes about the body and all of it."""
    difference = np.abs(np.angle(np.exp(1j * (bank.azimuth.astype(np.float64) - view))))
    sequences = np.flatnonzero(difference <= difference.min() + 1e-3)
    laid = [template for sequence in sequences for template in bank.templates[sequence]]
    if angle:
        laid = [_leaning(template, angle) for template in laid]
    tight, whole = (
        np.array([bounding_box((each > level).view(np.uint8)) for each in laid], np.int32)
        for level in (127, 0)
    )
    used = np.flatnonzero(tight[:, 2])
    return [laid[k] for k in used], tight[used], whole[used]


def _likely(
    box: Box,
    aspects: NDArray[np.float64],
    cuts: tuple[bool, bool, bool, bool],
    taller: float,
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.bool_], NDArray[np.float64]]:
    """
    Choose templates by the aspect of a box; see :func:`lay_onto`.

    :param aspects: of the templates, width over height.
    :returns: for each choice, (K,), the template, the height of the body in heights of the box,
        whether it goes on beyond one side, and the weight.
    """
    cut_top, cut_bottom, cut_left, cut_right = cuts
    cut = cut_top or cut_bottom
    sigma = _CUT_SIGMA if cut or (cut_left and cut_right) else _ASPECT_SIGMA
    factors = _TALLER if cut else (taller,)
    # Of a body that goes on beyond one side only the other side of the box is that of the body.
    beyond = (False, True) if cut_left != cut_right and not cut else (False,)
    options = [(factor, wider) for factor in factors for wider in beyond]
    which = np.repeat(np.arange(len(aspects)), len(options))
    factor = np.tile([factor for factor, _ in options], len(aspects))
    wide = np.tile([wider for _, wider in options], len(aspects))
    ratio = np.log(aspects[which] * factor * box.height / box.width)
    weight = np.exp(-0.5 * (np.where(wide, np.minimum(ratio, 0), ratio) / sigma) ** 2)
    weight[wide & (ratio > _MOST_BEYOND)] = 0
    likely = weight >= _NEGLIGIBLE * weight.max()
    return which[likely], factor[likely], wide[likely], weight[likely]


def _span(
    extent: NDArray[np.int32], scale: NDArray[np.float64], shift: NDArray[np.float64], size: int
) -> slice:
    """Return where templates are not black along one axis of the window, at least one pixel."""
    low = int(np.floor((scale * (extent[:, 0] - 1) + shift).min()))
    high = int(np.ceil((scale * extent.sum(axis=1) + shift).max())) + 1
    start = min(max(low, 0), size - 1)
    return slice(start, min(max(high, start + 1), size))


def _leaning(template: NDArray[np.uint8], angle: float) -> NDArray[np.uint8]:
    """Return a template turned about the middle of its grid, on a square one that holds it."""
    height, width = template.shape
    side = math.ceil(math.hypot(height, width))
    cos, sin = math.cos(angle), math.sin(angle)
    center = np.array([(width - 1) / 2, (height - 1) / 2])
    turn = np.array([[cos, -sin], [sin, cos]])
    matrix = np.column_stack([turn, (side - 1) / 2 - turn @ center])
    return np.asarray(cv2.warpAffine(template, matrix, (side, side)))
