# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What stays of a cut: the parts that belong to the person, without pinholes."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import Box

__all__ = ['fill_holes', 'keep_supported']

_LEAST_OVERLAP = 0.04
_LEAST_COVER = 0.4

_LEAST_SURE = 0.02
"""Least overlap of what lies on the body or is all but certain: a foot that the cut parted from
its leg, or a case in a hand."""

_ON, _APART = 0.03, 0.12
"""Distances from the body, in body heights, up to which a part lies on it, and from which it is
apart from it."""

_BODY_WIDE = 0.3
"""
Mean distance from the body, in body heights, up to which a part may be the rest of it.

Who comes out from behind a post is matched to one half, and the other lies apart from that.
"""

_SURE, _CERTAIN = 240.0, 245.0
"""
Mean likelihood (0..255) from which a part may lie that far from the body, and anywhere.

Colours never seen give less.
"""

_WHOLE = 0.8
"""Share of the body in the cut from which nothing of it is missing that could lie elsewhere."""

_LEAST_CLOSE = 0.5
"""Share of a part that must lie near the body."""


def keep_supported(
    labels: NDArray[np.bool_],
    support: NDArray[np.float32],
    body: NDArray[np.bool_] | None = None,
    height: float = 0.0,
    evidence: NDArray[np.uint8] | None = None,
) -> NDArray[np.bool_]:
    """
    Keep the component with the most support, and others that are well supported.

    What lies apart from the body does not count unless it is all but certain: colours that are not
    known make it likely, too, when somebody else passes by.  What lies on the body or is all but
    certain may be small.

    :param labels: (h, w) bool, the cut.
    :param support: (h, w) float32 in 0..1, where the person is expected.
    :param body: (h, w) bool, where the body is expected; None if that is not known.
    :param height: height of the body in pixels.
    :param evidence: (h, w) uint8, the likelihood.
    :returns: the component with the largest summed support and those with more than 4 % of that
        sum, 2 % on the body or all but certain, whose mean support is above 0.4; of the others
        only what lies mostly near the body.
    """
    count, parts = cv2.connectedComponents(labels.view(np.uint8), connectivity=4)
    if count <= 2:
        return labels
    area = np.bincount(parts.ravel(), minlength=count)
    close = area
    least = np.full(count, _LEAST_OVERLAP)
    if body is not None and body.any():
        away = cv2.distanceTransform((~body).view(np.uint8), cv2.DIST_L2, 3)
        on = np.bincount(parts.ravel(), (away <= _ON * height).ravel(), count)
        sure = on > _LEAST_CLOSE * area
        near = away <= _APART * height
        if evidence is not None:
            likely = np.bincount(parts.ravel(), evidence.ravel(), count)
            distance = np.bincount(parts.ravel(), away.ravel(), count)
            wide = distance <= _BODY_WIDE * height * area
            # Of whom all is seen, what is about as likely may be a mirror image.
            if np.count_nonzero(labels & body) >= _WHOLE * np.count_nonzero(body):
                wide[:] = False
            certain = likely >= np.where(wide, _SURE, _CERTAIN) * area
            sure |= certain
            near |= certain[parts]
        least[sure] = _LEAST_SURE
        support = support * near
        close = np.bincount(parts.ravel(), near.ravel(), count)
    overlap = np.bincount(parts.ravel(), support.ravel(), count)
    overlap[0] = 0
    best = overlap.max()
    keep = (overlap > least * best) & (overlap > _LEAST_COVER * area)
    keep &= close >= _LEAST_CLOSE * area
    keep[int(overlap.argmax())] = True
    keep[0] = False
    return np.asarray(keep[parts])


def fill_holes(labels: NDArray[np.bool_], largest: float) -> NDArray[np.bool_]:
    """
    Fill the holes of at most ``largest`` pixels that do not touch the border.

    :param labels: (h, w) bool.
    """
    found = Box.around(labels)
    if found is None:
        return labels
    # Beyond one pixel about the labels nothing is enclosed.
    part = found.padded(1, 1).slices(labels.shape[1], labels.shape[0])
    _, parts, stats, _ = cv2.connectedComponentsWithStats(
        (~labels[part]).view(np.uint8), connectivity=8
    )
    height, width = parts.shape
    left, top = stats[:, cv2.CC_STAT_LEFT], stats[:, cv2.CC_STAT_TOP]
    right, bottom = left + stats[:, cv2.CC_STAT_WIDTH], top + stats[:, cv2.CC_STAT_HEIGHT]
    hole = (stats[:, cv2.CC_STAT_AREA] <= largest) & (left > 0) & (top > 0)
    hole &= (right < width) & (bottom < height)
    hole[0] = False
    if not hole.any():
        return labels
    filled = labels.copy()
    filled[part] |= hole[parts]
    return filled
