# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Share of red, r = R / (R + G + B), which the brightness of the light does not change."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.tracking.features.base import View

__all__ = ['FEATURE']


class RedShare:
    """Share of red, r = R / (R + G + B), which the brightness of the light does not change."""

    name = 'r'
    has_neutral = False

    def channel(self, view: View) -> NDArray[np.uint8]:
        """Return the values of the pixels that are needed."""
        return view.share(2)


FEATURE = RedShare()
