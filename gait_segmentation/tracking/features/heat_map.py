# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A likelihood image from outside of this package, e.g. of a detector."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.tracking.features.base import DirectFeature, View

__all__ = ['FEATURE']

_LIMIT = 3.0


def _log_ratio(view: View) -> NDArray[np.float32] | None:
    """Return its logit, limited to +-3; None without a heat map."""
    if view.heat is None:
        return None
    share = (view.thin(view.heat).astype(np.float32) + np.float32(0.5)) / np.float32(256)
    return np.clip(np.log(share / (1 - share)), -_LIMIT, _LIMIT)


FEATURE = DirectFeature('heat map', _log_ratio)
