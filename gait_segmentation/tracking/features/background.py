# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The background pixel by pixel; see :mod:`gait_segmentation.tracking.background.model`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.tracking.features.base import View

__all__ = ['FEATURE']


class Background:
    """The background pixel by pixel; see :mod:`gait_segmentation.tracking.background.model`."""

    name = 'background'

    def log_ratio(self, view: View) -> NDArray[np.float32] | None:
        """Return the log-likelihood ratios of the pixels that are needed."""
        return view.evidence.get(self.name)


FEATURE = Background()
