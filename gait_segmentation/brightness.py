# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How much brighter one image is than another, by what most of it says."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ['Brightening', 'brightening']

Brightness = NDArray[np.uint8] | NDArray[np.float32]


class Brightening(NamedTuple):
    """
    The factor by which most pixels became brighter.

    ``log`` is its logarithm, ``share`` the part of the pixels that changed by it, and ``pixels``
    how many were compared; all are 0 if there are none.
    """

    log: float
    share: float
    pixels: int


def brightening(
    now: Brightness,
    before: Brightness,
    limits: tuple[float, float],
    alike: float,
) -> Brightening:
    """
    Measure by how much an image is brighter than another: the median, whatever else has changed.

    :param now, before: of the same shape.
    :param limits: brightness between which, in both, a pixel tells the factor: beyond it is noise
        or cut off.
    :param alike: how near to the median logarithm those are that changed by the same factor.
    """
    least, most = limits
    use = (now > least) & (now < most) & (before > least) & (before < most)
    logs = np.log(now[use].astype(np.float32) / before[use].astype(np.float32))
    if logs.size == 0:
        return Brightening(0.0, 0.0, 0)
    log = float(np.median(logs))
    same = np.count_nonzero(np.abs(logs - log) < alike)
    return Brightening(log, same / logs.size, logs.size)
