# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Hue, where there is enough colour to have one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.tracking.features.base import NEUTRAL, View

__all__ = ['FEATURE']

_LEAST_SATURATION = 20
"""Below it (of 255) the hue is noise."""


class Hue:
    """Hue, where there is enough colour to have one."""

    name = 'H'
    has_neutral = True

    def channel(self, view: View) -> NDArray[np.uint8]:
        """Return the values of the pixels that are needed."""
        hue, saturation = view.thin_hsv[..., 0], view.thin_hsv[..., 1]
        return np.where(saturation < _LEAST_SATURATION, NEUTRAL, np.maximum(hue, 8)).astype(
            np.uint8
        )


FEATURE = Hue()
