# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Blue of the camera."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.tracking.features.base import View

__all__ = ['FEATURE']


class Blue:
    """Blue of the camera."""

    name = 'B'
    has_neutral = False

    def channel(self, view: View) -> NDArray[np.uint8]:
        """Return the values of the pixels that are needed."""
        return view.plane(0)


FEATURE = Blue()
