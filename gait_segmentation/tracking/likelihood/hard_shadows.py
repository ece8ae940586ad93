# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The hard shadows that the sun casts in this very film: how dark, of which tint, and where.

They are as dark as trousers, move with the body and join the mask, which then teaches their
colours.  Clothes that dark look otherwise from pixel to pixel, though, while all hard shadows of a
film leave the same share of the light, and of what they take away the tint is the same.  So what
is dark on known ground apart from mask and template is learnt as one normal distribution of depth
and tint, and nothing is made of it unless it is narrow; nor, where others are near whose trousers
may be lit evenly, unless it is deep.  Whose shadow it is does not matter: where
people walk together the shadow of one touches another.

What a share of the light does to L, a* and b* is told in ``shadows.py``.  The tint is given in
parts of the lightness that is lost, as all that the sun does not reach has the light of one sky.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gait_segmentation.colour import BANDS, BIN_VOLUME, ColourModel
from gait_segmentation.geometry import BodyFrame
from gait_segmentation.lab import BLACK
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

__all__ = ['HardShadow', 'HardShadowModel']

_DARKEST, _LIGHTEST, _PENUMBRA = 0.2, 0.7, 0.9
"""Ratios of L + 16 that are learnt, from and to, and up to which a shadow fades at its rim."""

_FIRST_ROW = 3
"""Row of the places, of a tenth of the height each, above which nothing is told."""

_MARGIN, _MASK_MARGIN = 0.05, 0.03
"""Margins about template and mask from which nothing is learnt, in body heights."""

_KNOWN, _LEAST_COUNT, _DOUBT = 0.9, 0.5, 0.1
"""
Times a pixel of the background was seen from which shadows are learnt, and told; and for half the
trust.
"""

_LEAST_LIGHT = 60.0
"""Lightness of the background from which there are hard shadows on it."""

_MOST_TINT = 0.2
"""Most that a* or b* of what is dark may be off, in parts of the lightness lost."""

_KEEP = 0.9
"""Share of what was learnt that is left with the next mask."""

_MASKS, _LEAST_AREA = 3, 0.01
"""Masks, and area in squares of the body height, from which shadows are known."""

_MOST_SPREAD, _MOST_TINT_SPREAD, _MOST_MEAN_TINT = 0.13, 0.03, 0.07
"""
Standard deviation of ratio and of tint up to which dark pixels are shadows of one light, and how
far from neutral they may be on average; tints in parts of the lightness of the background.
"""

_DEEP = 0.5
"""Mean ratio up to which what is evenly dark is taken for a shadow where others are near."""

_LEAST_SPREAD, _LEAST_TINT_SPREAD, _ROUNDING = 0.05, 0.015, 1.5
"""Least standard deviations that are reckoned with, and levels of a* and b* from rounding."""

_FARTHEST = 16.0
"""Squared distance, in standard deviations, from which nothing is shadow."""

_FEW, _LEAST_SHARE = 20.0, 0.1
"""
Pixels at a place, weighed with those near by up to 81 times, that halve what shadows share; and
what they share at least, since those of other people lie anywhere.
"""

_LEAST_RATIO = -4.0
"""Log-likelihood ratio down to which shadows take pixels."""


@dataclass(frozen=True)
class HardShadow:
    """
    How a hard shadow looks: mean and standard deviation.

    ``ratio`` is of L + 16 in the shadow over the background's, ``tint`` what a* and b* are off
    over the lightness lost.
    """

    ratio: tuple[float, float]
    tint_a: tuple[float, float]
    tint_b: tuple[float, float]

    @property
    def is_of_one_light(self) -> bool:
        """Return whether it is so alike all over that it is no cloth."""
        lost = 1 - self.ratio[0]
        tints = self.tint_a, self.tint_b
        return (
            self.ratio[1] < _MOST_SPREAD
            and max(spread for _, spread in tints) * lost < _MOST_TINT_SPREAD
            and max(abs(mean) for mean, _ in tints) * lost < _MOST_MEAN_TINT
        )


class HardShadowModel:
    """
    What is learnt of the hard shadows about one person; at first there are none.

    ``known`` is how they look, None if there are none; ``share`` is (rows, columns) float32, the
    share of the background seen at a place about the body that is in them.
    """

    def __init__(self) -> None:
        """Know of no shadows."""
        self.known: HardShadow | None = None
        self.share = np.zeros((ROWS, COLUMNS), np.float32)
        # Pixels, and the sums of ratio and tints and of their squares.
        self._sums = np.zeros(7, np.float64)
        # Of all that was seen of the background, and of what was dark.
        self._seen = np.zeros((2, ROWS, COLUMNS), np.float32)
        self._masks = 0
        self._weight = 0.0

    def learn(
        self,
        seen: Backdrop,
        body: BodyFrame,
        mask: NDArray[np.uint8],
        template: NDArray[np.uint8],
        *,
        company: bool = False,
    ) -> None:
        """
        Learn from what a frame shows about a person.

        Images without colour teach nothing: clothes are told from shadows by their tint.

        :param seen: the window about the person.
        :param body: where it is, in working pixels.
        :param mask: (H, W) uint8, above 127 on the person, about whom nothing is learnt.
        :param template: (H, W) uint8, above 127 on the body: nor about that.
        :param company: whether somebody without a slot is near, in clothes that may be dark, too.
        """
        if seen.textured:
            self.known = None
            return
        self._masks += 1
        self._weight = _KEEP * self._weight + 1
        _learn(
            seen.lab,
            seen.background.sums,
            seen.window[0].start,
            seen.window[1].start,
            mask,
            template,
            max(1, round(_MARGIN * body.height)),
            max(1, round(_MASK_MARGIN * body.height)),
            seen.place(body),
            seen.neutral,
            self._sums,
            self._seen,
        )
        settle_places(self._seen, _FEW, self.share)
        self.known = self._judged(body.height, company=company)

    def weigh(
        self,
        logit: NDArray[np.float32],
        seen: Backdrop,
        body: BodyFrame,
        template: NDArray[np.uint8],
        bins: NDArray[np.uint16],
        rows: NDArray[np.float32],
        person: ColourModel,
        trust: float,
    ) -> None:
        """
        Take what may be a hard shadow outside of the template into log-likelihood ratios.

        :param logit: (h, w) float32, ln p(person) / p(surroundings), changed.
        :param seen: the window they are of.
        :param body: where the person's is, in working pixels.
        :param template: (h, w) uint8 of the window, above 127 on the body.
        :param bins: (h, w) uint16, joint colour bins of the window.
        :param rows: (h, w) float32, position down the body.
        :param person: colours of the person.
        :param trust: most that the background can weigh.
        """
        if self.known is None or seen.textured:
            return
        look = self.known
        _weigh(
            logit,
            seen.lab,
            bins,
            rows,
            seen.background.sums,
            seen.window[0].start,
            seen.window[1].start,
            person.table,
            template,
            max(1, round(_MARGIN * body.height)),
            seen.place(body),
            seen.neutral,
            (look.ratio[0], look.tint_a[0], look.tint_b[0]),
            (
                max(look.ratio[1], _LEAST_SPREAD),
                max(look.tint_a[1], _LEAST_TINT_SPREAD),
                max(look.tint_b[1], _LEAST_TINT_SPREAD),
            ),
            self.share,
            trust,
        )

    def _judged(self, height: float, *, company: bool) -> HardShadow | None:
        """Return how the shadows look, None if what is dark is little or not of one light."""
        count = self._sums[0]
        area = EVERY**2 * count / self._weight
        if self._masks < _MASKS or area <= _LEAST_AREA * height**2:
            return None
        means = self._sums[1:4] / count
        spreads = np.sqrt(np.maximum(self._sums[4:7] / count - means**2, 0))
        ratio, tint_a, tint_b = zip(means.tolist(), spreads.tolist(), strict=True)
        look = HardShadow(ratio, tint_a, tint_b)
        if company and ratio[0] > _DEEP:
            return None
        return look if look.is_of_one_light else None


@njit(nogil=True, error_model='numpy', inline='always')
def _look(
    pixel: NDArray[np.uint8], known: NDArray[np.float32], darkest: float, lightest: float
) -> tuple[float, float]:
    """Return the lightness of a pixel's background and the pixel's ratio to it; or 0, 0."""
    count, black = known[3], np.float32(BLACK)
    # Most pixels are told without a division.
    light = (np.float32(pixel[0]) + black) * count
    base = known[0] + black * count
    least = (np.float32(_LEAST_LIGHT) + black) * count
    if base < least or light < darkest * base or light > lightest * base:
        return np.float32(0), np.float32(0)
    return base / count, light / base


@njit(cache=True, nogil=True, error_model='numpy')
def _learn(
    lab: NDArray[np.uint8],
    sums: NDArray[np.float32],
    top: int,
    left: int,
    mask: NDArray[np.uint8],
    template: NDArray[np.uint8],
    margin: int,
    mask_margin: int,
    place: Place,
    neutral: float,
    learnt: NDArray[np.float64],
    seen: NDArray[np.float32],
) -> None:
    """Fade what was learnt, and take in the pixels of the background, and what is dark on it."""
    learnt *= _KEEP
    seen *= np.float32(_KEEP)
    fewest, middle = np.float32(_KNOWN), np.float32(neutral)
    darkest, lightest = np.float32(_DARKEST), np.float32(_LIGHTEST)
    least = np.float32(_LEAST_LIGHT)
    first_row, first_column, step = place
    for row in range(0, lab.shape[0], EVERY):
        y = top + row
        down = math.floor(first_row + step * row)
        if down < _FIRST_ROW or down >= ROWS:
            continue
        for col in range((row // EVERY) % EVERY, lab.shape[1], EVERY):
            x = left + col
            across = math.floor(first_column + step * col)
            known = sums[y, x]
            if across < 0 or across >= COLUMNS or known[3] < fewest:
                continue
            if known[0] < least * known[3]:
                continue
            if is_near(template, y, x, margin, 127) or is_near(mask, y, x, mask_margin, 127):
                continue
            seen[0, down, across] += np.float32(1)
            pixel = lab[row, col]
            base, ratio = _look(pixel, known, darkest, lightest)
            if base == 0:
                continue
            lost = base * (1 - ratio)
            a = tint_of(pixel[1], known[1], known[3], ratio, middle) / lost
            b = tint_of(pixel[2], known[2], known[3], ratio, middle) / lost
            if abs(a) > _MOST_TINT or abs(b) > _MOST_TINT:
                continue
            seen[1, down, across] += np.float32(1)
            learnt[0] += 1
            learnt[1] += ratio
            learnt[2] += a
            learnt[3] += b
            learnt[4] += ratio * ratio
            learnt[5] += a * a
            learnt[6] += b * b


@njit(cache=True, nogil=True, error_model='numpy')
def _weigh(
    logit: NDArray[np.float32],
    lab: NDArray[np.uint8],
    bins: NDArray[np.uint16],
    rows: NDArray[np.float32],
    sums: NDArray[np.float32],
    top: int,
    left: int,
    person: NDArray[np.float32],
    template: NDArray[np.uint8],
    margin: int,
    place: Place,
    neutral: float,
    means: tuple[float, float, float],
    spreads: tuple[float, float, float],
    share: NDArray[np.float32],
    trust: float,
) -> None:
    """Add the shadows to the surroundings' side of log-likelihood ratios."""
    lowest, one = np.float32(_LEAST_RATIO), np.float32(1)
    fewest, doubt = np.float32(_LEAST_COUNT), np.float32(_DOUBT)
    darkest, lightest = np.float32(_DARKEST), np.float32(_PENUMBRA)
    middle = np.float32(neutral)
    # Of a bin over the density, which is even from the deepest shadow to the rim of the penumbra.
    volume = BIN_VOLUME / (2 * math.pi * (_PENUMBRA - means[0]))
    first_row, first_column, step = place
    for row in range(logit.shape[0]):
        line = logit[row]
        down = math.floor(first_row + step * row)
        if down < _FIRST_ROW or down >= ROWS:
            continue
        for col in range(line.size):
            if line[col] <= lowest:
                continue
            across = math.floor(first_column + step * col)
            known = sums[top + row, left + col]
            if across < 0 or across >= COLUMNS or known[3] < fewest:
                continue
            pixel = lab[row, col]
            base, ratio = _look(pixel, known, darkest, lightest)
            if base == 0 or is_near(template, row, col, margin, 127):
                continue
            lost = base * (one - ratio)
            spread_a, spread_b = spreads[1] * lost + _ROUNDING, spreads[2] * lost + _ROUNDING
            a = tint_of(pixel[1], known[1], known[3], ratio, middle) - means[1] * lost
            b = tint_of(pixel[2], known[2], known[3], ratio, middle) - means[2] * lost
            deeper = min(ratio - means[0], 0.0) / spreads[0]
            off = deeper**2 + (a / spread_a) ** 2 + (b / spread_b) ** 2
            if off > _FARTHEST:
                continue
            density = math.exp(-off / 2) * volume / (spread_a * spread_b * base)
            likely = trust * max(share[down, across], _LEAST_SHARE) * known[3] / (known[3] + doubt)
            band = min(max(int(rows[row, col] * np.float32(BANDS)), 0), BANDS - 1)
            odds = likely * density / person[bins[row, col], band] * math.exp(line[col])
            line[col] = max(line[col] - np.float32(math.log(1 + odds)), lowest)
