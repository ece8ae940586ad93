# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What several frames agree on about a place, and what stands out against it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import Window
from gait_segmentation.kernels import kernel

__all__ = ['SURE_COUNT', 'Recollection', 'agreed', 'spread']

SURE_COUNT = 2
"""Frames in which something must be seen to be known."""

_ALIKE = 20
"""Most that colours of the same pixel of the background differ by, in grey levels a channel."""

_LEAST_SHARE = 0.5
"""Share of the frames in which a pixel must look alike."""

_SIGMA_START, _SIGMA_LOW, _SIGMA_HIGH = 5.0, 2.5, 14.0
_LEAST_SPREAD = 50
_NEUTRAL, _GAIN, _LIMIT = 4.0, 0.75, 3.0
"""Half the squared distance in ``sigma`` that says nothing, evidence per step, and its limit."""


@dataclass(frozen=True)
class Recollection:
    """
    The background as it is remembered, in a window of the newest frame.

    ``mean`` is (h, w, 3) uint8 Lab and ``count`` (h, w) uint8, in how many frames it was seen,
    0 where it is unknown.  ``sigma`` is the spread about it in grey levels.
    """

    window: Window
    mean: NDArray[np.uint8]
    count: NDArray[np.uint8]
    sigma: float

    def evidence(self, lab: NDArray[np.uint8], shadow_floor: float) -> NDArray[np.float32]:
        """
        Return evidence for a person, (h, w) float32 within +-3, 0 where nothing is known.

        What is a little darker and of the same chroma is hardly clothes of just that colour; the
        darker a shadow would be, the less is said.

        :param lab: (h, w, 3) uint8, the window of the newest frame.
        :param shadow_floor: darkest shadow, as a share of the lightness.
        """
        here, mean = lab.astype(np.float32), self.mean.astype(np.float32)
        off = here - mean
        scale = np.float32(1 / (2 * self.sigma**2))
        chroma = (off[..., 1] ** 2 + off[..., 2] ** 2) * scale
        logit = _GAIN * (chroma + off[..., 0] ** 2 * scale - _NEUTRAL)
        # A shadow takes colour away in proportion to the light, or leaves it.
        share = here[..., 0] / np.maximum(mean[..., 0], 1)
        less = here[..., 1:] - 128 - share[..., None] * (mean[..., 1:] - 128)
        chroma = np.minimum(chroma, (less**2).sum(axis=2) * scale)
        depth = (1 - share) / (1 - shadow_floor)
        shadow = _GAIN * (chroma - _NEUTRAL * (1 - depth))
        dark = (share < 1) & (share > shadow_floor)
        logit = np.where(dark, np.minimum(logit, shadow), logit)
        known = self.count.astype(np.float32)
        known = np.where(known >= SURE_COUNT, known / (known + 1), 0)
        return (np.clip(logit, -_LIMIT, _LIMIT) * known).astype(np.float32)


def spread(off: NDArray[np.uint8]) -> float:
    """Return the spread of differences in grey levels, as the background measures it."""
    if len(off) < _LEAST_SPREAD:
        return _SIGMA_START
    sigma = 1.2 * 1.4826 * (float(np.median(off)) + 0.5) + 1.5
    return min(max(sigma, _SIGMA_LOW), _SIGMA_HIGH)


@kernel('u1[:,:,:,::1], u1[:,:,::1]')
def agreed(
    images: NDArray[np.uint8], masks: NDArray[np.uint8]
) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Return for each pixel the mean of what looks alike in most frames, and in how many."""
    frames, height, width = masks.shape
    mean = np.zeros((height, width, 3), np.uint8)
    count = np.zeros((height, width), np.uint8)
    order = np.zeros(frames, np.int64)
    for row in range(height):
        for col in range(width):
            known = 0
            for k in range(frames):
                if masks[k, row, col]:
                    continue
                place = known
                value = images[k, row, col, 1]
                while place > 0 and images[order[place - 1], row, col, 1] > value:
                    order[place] = order[place - 1]
                    place -= 1
                order[place] = k
                known += 1
            if known == 0:
                continue
            middle = order[known // 2]
            alike = 0
            sums = np.zeros(3, np.int64)
            for n in range(known):
                k = order[n]
                same = True
                for channel in range(3):
                    off = np.int32(images[k, row, col, channel]) - np.int32(
                        images[middle, row, col, channel]
                    )
                    if abs(off) > _ALIKE:
                        same = False
                if same:
                    alike += 1
                    for channel in range(3):
                        sums[channel] += images[k, row, col, channel]
            if alike < _LEAST_SHARE * known:
                continue
            for channel in range(3):
                mean[row, col, channel] = (sums[channel] + alike // 2) // alike
            count[row, col] = alike
    return mean, count
