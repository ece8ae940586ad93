# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What moves with the body; see :mod:`gait_segmentation.tracking.likelihood.cues`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.tracking.features.base import View

__all__ = ['FEATURE']


class Moving:
    """What moves with the body; see :mod:`gait_segmentation.tracking.likelihood.cues`."""

    name = 'motion'

    def log_ratio(self, view: View) -> NDArray[np.float32] | None:
        """Return the log-likelihood ratios of the pixels that are needed."""
        return view.evidence.get(self.name)


FEATURE = Moving()
