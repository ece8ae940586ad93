# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Hue, where there is enough colour to have one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.kernels import kernel
from gait_segmentation.tracking.features.base import NEUTRAL, ChannelFeature, View

__all__ = ['FEATURE']

_LEAST_SATURATION = 20
"""Below it (of 255) the hue is noise."""

_FIRST = 8
"""Hues below it are taken for it, so that none is neutral."""


def _channel(view: View) -> NDArray[np.uint8]:
    """Return the hue of the pixels that are needed."""
    hsv = view.thin_hsv
    out = np.empty(hsv.shape[:2], np.uint8)
    _hue(hsv, out)
    return out


@kernel('u1[:,:,::1], u1[:,::1]')
def _hue(hsv: NDArray[np.uint8], out: NDArray[np.uint8]) -> None:
    """Fill in the hue, which never is NEUTRAL, and NEUTRAL where it is noise."""
    for row in range(out.shape[0]):
        pixels, result = hsv[row].reshape(-1), out[row]
        for col in range(result.size):
            hue = max(pixels[3 * col], np.uint8(_FIRST))
            result[col] = hue if pixels[3 * col + 1] >= _LEAST_SATURATION else NEUTRAL


FEATURE = ChannelFeature('H', _channel, has_neutral=True)
