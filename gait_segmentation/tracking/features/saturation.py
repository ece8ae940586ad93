# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Saturation: colourful against grey."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.tracking.features.base import View

__all__ = ['FEATURE']


class Saturation:
    """Saturation: colourful against grey."""

    name = 'S'
    has_neutral = False

    def channel(self, view: View) -> NDArray[np.uint8]:
        """Return the values of the pixels that are needed."""
        return np.asarray(cv2.extractChannel(view.thin_hsv, 1))


FEATURE = Saturation()
