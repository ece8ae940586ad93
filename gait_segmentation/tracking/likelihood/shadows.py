# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The soft shadows somebody casts in this very film: how dark, of which tint, and where.

How a shadow looks depends on the film: on paving under an overcast sky it lies all about the
feet, a lamp throws it onto the wall behind, and what light is left has a tint of its own.  What a
fixed share of shadows says is little against colours once learnt from a mask that had taken the
shadow in.  But most of the shadow lies beside the mask, before a background that is known.  So
the person's shadows are learnt there, in two histograms: of how a pixel has changed against the
background, and of the places about the body where it has.

In Lab all but the darkest lights are a cube root, so that a shadow that leaves a share k of the
light takes L + 16, a and b to k^(1/3) of what they were.  What a and b differ from that is tint.
Deep shadows and strong tints are not learnt: clothes look like them.  Nor is what lies next to
something that is neither background nor shadow, as it does on people who walk alongside.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.colour import BANDS, BIN_VOLUME, ColourModel
from gait_segmentation.geometry import BodyFrame
from gait_segmentation.kernels import kernel
from gait_segmentation.lab import BLACK
from gait_segmentation.tracking.background.kernels import SURE_COUNT
from gait_segmentation.tracking.likelihood.backdrop import (
    COLUMNS,
    EVERY,
    ROWS,
    Backdrop,
    Place,
    is_near,
    settle_places,
    tint_of,
)

__all__ = ['ShadowModel']

_DARKEST, _DEPTH_STEP, _DEPTHS = 0.75, 0.05, 5
"""Ratio of these that the deepest shadow has, and the bins from there to 1."""

_TINT_STEP, _TINTS = 3.0, 5
"""Grey levels of a* or b* a bin, and the bins, of which the middle one has no tint."""

_LEAST_COUNT, _DOUBT = 0.5, 0.1
"""Times a pixel of the background was seen from which shadows are told, and for half the trust."""

_LEAST_LIGHT = 20.0
"""Lightness of the background from which there are shadows on it."""

_MARGIN, _MASK_MARGIN = 0.03, 0.05
"""Margins about template and mask from which nothing is learnt, in body heights."""

_MASKS, _KEEP = 2, 0.9
"""Every how many masks shadows are learnt, and the share of what was learnt that is left then."""

_FEW = 80.0
"""Pixels at a place, weighed with those near by up to 81 times, that halve what shadows share."""

_LEAST_RATIO = -1.0
"""
Log-likelihood ratio down to which shadows take pixels: clothes may be a little darker than what
is behind them, and what a mask missed of them once must not be missed for ever.
"""


class ShadowModel:
    """
    What is learnt of the shadows of one person; at first there are none.

    ``density`` is (depths, tints, tints) float32, the share of the shadows that is that deep and
    has that tint of a* and b*; ``share`` is (rows, columns) float32, the share of the background
    seen at a place about the body that is in their shadow.
    """

    def __init__(self) -> None:
        """Know of no shadows."""
        shape = (_DEPTHS, _TINTS, _TINTS)
        self.density = np.zeros(shape, np.float32)
        self.share = np.zeros((ROWS, COLUMNS), np.float32)
        self._counts = np.zeros(shape, np.float32)
        # Of all that was seen of the background, and of what was shadow.
        self._seen = np.zeros((2, ROWS, COLUMNS), np.float32)
        self._masks = 0

    def learn(
        self,
        seen: Backdrop,
        body: BodyFrame,
        mask: NDArray[np.uint8],
        template: NDArray[np.uint8],
        strange: NDArray[np.uint8],
    ) -> None:
        """
        Learn from what a frame shows about a person.

        :param seen: the window about the person.
        :param body: where it is, in working pixels.
        :param mask: (H, W) uint8, above 127 on the person, about whom nothing is learnt.
        :param template: (H, W) uint8, above 127 on the body: nor about that.
        :param strange: (h, w) uint8, non-zero where the window looks neither as the background
            is known to nor as a shadow on it: soft shadows lie apart from that.
        """
        self._masks += 1
        if self._masks % _MASKS:
            return
        _learn(
            seen.lab,
            seen.background.sums,
            seen.window[0].start,
            seen.window[1].start,
            mask,
            template,
            strange,
            max(1, round(_MARGIN * body.height)),
            max(1, round(_MASK_MARGIN * body.height)),
            seen.place(body),
            seen.darker,
            seen.neutral,
            self._counts,
            self._seen,
        )
        _settle(self._counts, self._seen, self.density, self.share)

    def weigh(
        self,
        logit: NDArray[np.float32],
        seen: Backdrop,
        body: BodyFrame,
        bins: NDArray[np.uint16],
        rows: NDArray[np.float32],
        person: ColourModel,
        trust: float,
    ) -> None:
        """
        Take what may be the person's shadow into log-likelihood ratios.

        :param logit: (h, w) float32, ln p(person) / p(surroundings), changed.
        :param seen: the window they are of.
        :param body: where the person's is, in working pixels.
        :param bins: (h, w) uint16, joint colour bins of the window.
        :param rows: (h, w) float32, position down the body.
        :param person: colours of the person.
        :param trust: most that the background can weigh.
        """
        _weigh(
            logit,
            seen.lab,
            bins,
            rows,
            seen.background.sums,
            seen.window[0].start,
            seen.window[1].start,
            person.table,
            seen.place(body),
            seen.darker,
            seen.neutral,
            self.density,
            self.share,
            trust,
        )


@njit(nogil=True, error_model='numpy', inline='always')
def _depth_and_tint(
    pixel: NDArray[np.uint8], known: NDArray[np.float32], darker: np.float32, neutral: np.float32
) -> tuple[int, int, int]:
    """Return the bins of a pixel against the sums of its background; -1 if it is no shadow."""
    count, black = known[3], np.float32(BLACK)
    light = np.float32(pixel[0]) * count
    # Most pixels are told without a division.
    if light > known[0] - darker * count or known[0] < np.float32(_LEAST_LIGHT) * count:
        return -1, 0, 0
    if light + black * count < np.float32(_DARKEST) * (known[0] + black * count):
        return -1, 0, 0
    ratio = (light + black * count) / (known[0] + black * count)
    depth = min(int((ratio - np.float32(_DARKEST)) * np.float32(1 / _DEPTH_STEP)), _DEPTHS - 1)
    scale, middle = np.float32(1 / _TINT_STEP), np.float32(_TINTS / 2)
    a = tint_of(pixel[1], known[1], count, ratio, neutral)
    b = tint_of(pixel[2], known[2], count, ratio, neutral)
    a, b = a * scale + middle, b * scale + middle
    if a < 0 or a >= _TINTS or b < 0 or b >= _TINTS:
        return -1, 0, 0
    return depth, int(a), int(b)


@kernel(
    'u1[:,:,::1], f4[:,:,::1], i8, i8, u1[:,::1], u1[:,::1], u1[:,::1], i8, i8, '
    'UniTuple(f8, 3), f8, f8, f4[:,:,::1], f4[:,:,::1]',
    error_model='numpy',
)
def _learn(
    lab: NDArray[np.uint8],
    sums: NDArray[np.float32],
    top: int,
    left: int,
    mask: NDArray[np.uint8],
    template: NDArray[np.uint8],
    strange: NDArray[np.uint8],
    margin: int,
    mask_margin: int,
    place: Place,
    darker: float,
    neutral: float,
    counts: NDArray[np.float32],
    seen: NDArray[np.float32],
) -> None:
    """Fade what was counted, and count the pixels of the background, and of shadows on it."""
    keep, fewest = np.float32(_KEEP), np.float32(SURE_COUNT)
    least, middle = np.float32(darker), np.float32(neutral)
    counts *= keep
    seen *= keep
    first_row, first_column, step = place
    for row in range(0, lab.shape[0], EVERY):
        y = top + row
        down = math.floor(first_row + step * row)
        if down < 0 or down >= ROWS:
            continue
        for col in range((row // EVERY) % EVERY, lab.shape[1], EVERY):
            x = left + col
            across = math.floor(first_column + step * col)
            if across < 0 or across >= COLUMNS or sums[y, x, 3] < fewest:
                continue
            if is_near(template, y, x, margin, 127) or is_near(mask, y, x, mask_margin, 127):
                continue
            seen[0, down, across] += np.float32(1)
            depth, a, b = _depth_and_tint(lab[row, col], sums[y, x], least, middle)
            if depth < 0 or is_near(strange, row, col, margin, 0):
                continue
            if not is_near(strange, row, col, 2 * margin, 0):
                counts[depth, a, b] += np.float32(1)
                seen[1, down, across] += np.float32(1)


@kernel('f4[:,:,::1], f4[:,:,::1], f4[:,:,::1], f4[:,::1]', error_model='numpy')
def _settle(
    counts: NDArray[np.float32],
    seen: NDArray[np.float32],
    density: NDArray[np.float32],
    share: NDArray[np.float32],
) -> None:
    """Smooth what was counted: bins by 1 2 1, places by 1 2 3 2 1 along each axis."""
    total = max(counts.sum(), np.float32(1))
    for depth in range(_DEPTHS):
        for a in range(_TINTS):
            for b in range(_TINTS):
                value = np.float32(0)
                for i in range(max(depth - 1, 0), min(depth + 2, _DEPTHS)):
                    for j in range(max(a - 1, 0), min(a + 2, _TINTS)):
                        for k in range(max(b - 1, 0), min(b + 2, _TINTS)):
                            weight = (2 - abs(i - depth)) * (2 - abs(j - a)) * (2 - abs(k - b))
                            value += np.float32(weight) * counts[i, j, k]
                density[depth, a, b] = value / (np.float32(64) * total)
    settle_places(seen, _FEW, share)


@kernel(
    'f4[:,::1], u1[:,:,::1], u2[:,::1], f4[:,::1], f4[:,:,::1], i8, i8, f4[:,::1], '
    'UniTuple(f8, 3), f8, f8, f4[:,:,::1], f4[:,::1], f8',
    error_model='numpy',
)
def _weigh(
    logit: NDArray[np.float32],
    lab: NDArray[np.uint8],
    bins: NDArray[np.uint16],
    rows: NDArray[np.float32],
    sums: NDArray[np.float32],
    top: int,
    left: int,
    person: NDArray[np.float32],
    place: Place,
    darker: float,
    neutral: float,
    density: NDArray[np.float32],
    share: NDArray[np.float32],
    trust: float,
) -> None:
    """Add the shadows to the surroundings' side of log-likelihood ratios."""
    lowest, one = np.float32(_LEAST_RATIO), np.float32(1)
    fewest, most = np.float32(_LEAST_COUNT), np.float32(trust)
    least, middle, black = np.float32(darker), np.float32(neutral), np.float32(BLACK)
    doubt = np.float32(_DOUBT)
    # Of a bin in grey levels it is the background's lightness times this.
    volume = np.float32(BIN_VOLUME / (_DEPTH_STEP * _TINT_STEP * _TINT_STEP))
    first_row, first_column, step = place
    for row in range(logit.shape[0]):
        line = logit[row]
        down = min(max(math.floor(first_row + step * row), 0), ROWS - 1)
        for col in range(line.size):
            if line[col] <= lowest:
                continue
            across = min(max(math.floor(first_column + step * col), 0), COLUMNS - 1)
            known = sums[top + row, left + col]
            if known[3] < fewest:
                continue
            depth, a, b = _depth_and_tint(lab[row, col], known, least, middle)
            if depth < 0:
                continue
            shadow = most * share[down, across] * density[depth, a, b] * volume * known[3]
            shadow /= (known[0] / known[3] + black) * (known[3] + doubt)
            band = min(max(int(rows[row, col] * np.float32(BANDS)), 0), BANDS - 1)
            odds = shadow / person[bins[row, col], band] * np.float32(math.exp(line[col]))
            line[col] = max(line[col] - np.float32(math.log(one + odds)), lowest)
