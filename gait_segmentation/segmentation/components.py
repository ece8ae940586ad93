# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What stays of a cut: the parts that belong to the person."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import distance_from

__all__ = ['keep_supported']

_LEAST_OVERLAP = 0.04
"""Summed support of a part, as a share of the best one's, from which it may stay."""

_APART = 0.12
"""Distance from the template, in body heights, beyond which nothing supports a part."""


def keep_supported(
    labels: NDArray[np.bool_],
    support: NDArray[np.float32],
    body: NDArray[np.bool_] | None = None,
    height: float = 0.0,
) -> NDArray[np.bool_]:
    """
    Keep the components with more than 4 % of the largest one's support.

    Of a part that lies mostly apart from the body nothing counts: that is somebody who passes by.

    :param labels: (h, w) bool, the cut.
    :param support: (h, w) float32 in 0..1, where the person is expected.
    :param body: (h, w) bool, where the template is; None if that is not known.
    :param height: height of the body in pixels.
    """
    count, parts = cv2.connectedComponents(labels.view(np.uint8), connectivity=4)
    if count <= 2:
        return labels
    overlap = np.bincount(parts.ravel(), support.ravel(), count)
    overlap[0] = 0
    if body is not None and body.any():
        away = distance_from(body)
        apart = np.bincount(parts.ravel(), (away > _APART * height).ravel(), count)
        overlap[2 * apart > np.bincount(parts.ravel(), minlength=count)] = 0
    return np.asarray((overlap > _LEAST_OVERLAP * overlap.max())[parts])
