# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""From areas to similarities."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ['tanimoto']


def tanimoto(
    common: NDArray[np.int32], window_area: NDArray[np.int32], template_area: NDArray[np.int32]
) -> NDArray[np.float32]:
    """
    Return the Tanimoto similarity S = C / (F + G - C), 0 where both areas are 0.

    The text of the paper calls the same quantity a distance in one place; here 1 is equality.
    Wang, Yagi and Makihara, ACCV 2009, equation 1.

    :param common: C, int32 of any shape.
    :param window_area: F, the sum over the window, broadcast to it.
    :param template_area: G, the sum over the template, broadcast to it.
    :returns: float32 in [0, 1].
    """
    union = window_area + template_area - common
    return np.divide(
        common,
        union,
        out=np.zeros(union.shape, np.float32),
        where=union > 0,
        dtype=np.float32,
        casting='unsafe',
    )
