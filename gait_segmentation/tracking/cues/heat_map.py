# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The cue from a heat map: what its values mean for one person, learnt from where they were.

A heat map's own numbers are not taken for granted: networks are overconfident, and a map may be
inverted, shifted, late or of another camera.  What they mean is learnt, see
:class:`.MapCalibration`.

How far a map is off is where it correlates best with what all else says of the pixels, in the
mean over some frames, and how well it does there is how much it counts.  One that has nothing to
do with the person counts nothing, and an inverted one is used the other way round.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import Box
from gait_segmentation.heat_maps import MapCalibration
from gait_segmentation.images import Window, shifted_part, size_of
from gait_segmentation.scene.scene import Shift
from gait_segmentation.tracking.cues import Cue, CueInput

_FLOOR = 0.03
"""Share of the pixels of either kind that may have any value, which limits the evidence."""

_FILLED = 0.5
"""Share of a tight box that is the person."""

_SMALL = 24
"""Height in pixels to which a taller body is reduced when the map is laid on it."""

_REACH = 0.6
"""How far off a map may be, in body heights."""

_FIT_RATE = 0.4
"""Share by which the correlations move towards those of the newest frame."""

_STRANGE, _TRUSTED = 0.65, 0.8
"""
Correlation up to which a map has nothing to do with the person, and from which it counts in full:
another person's silhouette rarely comes to the first, a map three frames late to the second.
"""

_DOUBT = 0.02
"""
By how much less a map counts with each frame in which it does not agree: what has long agreed is
trusted for a while, since all else may have gone astray.
"""


class HeatMapCue(Cue):
    """What the values of a heat map say of one person."""

    def __init__(self) -> None:
        self._grades = MapCalibration(_FLOOR)
        self._fit: NDArray[np.float64] | None = None
        self._off: Shift = (0.0, 0.0)
        self._agrees = True
        self.weight = 0.0
        """How much the map counts, 0 to 1."""

    def begin(self, heat: NDArray[np.uint8], box: Box, window: Window) -> None:
        """
        Learn from a tight box alone: what of it is not as beside it is the person.

        :param heat: (H, W) uint8, the map, which is placed already.
        :param window: rows and columns about the box.
        """
        inside = np.zeros(heat.shape, np.uint8)
        inside[box.slices(heat.shape[1], heat.shape[0])] = 1
        within, other = MapCalibration.count(self.part(heat, window), inside[window])
        person = np.maximum(within - (1 - _FILLED) * other, 0)
        if person.any() and other.any():
            self._grades.shares = np.stack([person / person.sum(), other])

    def place(
        self,
        heat: NDArray[np.uint8],
        window: Window,
        likely: NDArray[np.float32],
        height: float,
        moved: Shift = (0.0, 0.0),
    ) -> None:
        """
        Find how far the map is off, and how much it counts.

        :param heat: (H, W) uint8, the map.
        :param likely: (h, w) float32 of the window in 0..1, how likely its pixels are by all else.
        :param height: of the body in pixels.
        :param moved: how far the person went since the frame of the map.
        """
        # Not enlarged: a box of less than a pixel would make an image of gigabytes.
        scale, reach = min(_SMALL / height, 1.0), math.ceil(_REACH * _SMALL)
        rows, columns = (round(scale * each) for each in size_of(window))
        if not (rows and columns):
            return
        left, top = window[1].start - moved[0], window[0].start - moved[1]
        corner = left - reach / scale, top - reach / scale
        about = _reduced(heat, scale, corner, (columns + 2 * reach, rows + 2 * reach))
        fit = cv2.matchTemplate(
            about, _reduced(likely, scale, (0.0, 0.0), (columns, rows)), cv2.TM_CCOEFF_NORMED
        )
        # Where the map is the same all over it is not known.
        fit = np.where(np.isfinite(fit), np.clip(fit, -1, 1), 0).astype(np.float64)
        self._fit = fit if self._fit is None else self._fit + _FIT_RATE * (fit - self._fit)
        # An inverted map tells as much.
        size = np.abs(self._fit)
        row, column = divmod(int(np.argmax(size)), size.shape[1])
        best = size[row, column]
        self._agrees = abs(fit[row, column]) >= _TRUSTED
        weight = float(np.clip((best - _STRANGE) / (_TRUSTED - _STRANGE), 0, 1))
        self.weight = max(weight, self.weight - _DOUBT)
        self._off = (0.0, 0.0)
        if best > size[reach, reach]:
            x, y = _peak(size[row], column), _peak(size[:, column], row)
            self._off = (x - reach) / scale, (y - reach) / scale

    def part(
        self, heat: NDArray[np.uint8], window: Window, moved: Shift = (0.0, 0.0)
    ) -> NDArray[np.uint8]:
        """
        Return a window of the map, (h, w) uint8, put where it belongs.

        :param heat: (H, W) uint8, the map.
        :param moved: see :meth:`place`.
        """
        dx, dy = (round(there - off) for there, off in zip(moved, self._off, strict=True))
        return shifted_part(heat, dx, dy, window)

    def evidence(self, given: CueInput) -> NDArray[np.float32] | None:
        """Put the map where it belongs and return its evidence, see :meth:`Cue.evidence`."""
        frame = given.view.now
        if frame.heat is None:
            return None
        moved = given.moved(given.states[max(-1 - frame.heat_frames, -len(given.states))])
        if given.seen:
            likely = np.asarray(1 / (1 + np.exp(-given.logit)), np.float32)
            self.place(frame.heat, given.window, likely, given.pose.height, moved)
        part = self.part(frame.heat, given.window, moved)
        self.note(given, part)
        return self.evidence_of(part)

    def evidence_of(self, values: NDArray[np.uint8]) -> NDArray[np.float32]:
        """
        Return the log-likelihood ratios of the person, 0 if nothing is known of the map.

        :param values: (h, w) uint8, a part of the map; the result is as large, float32.
        """
        return self._grades.evidence(values, self.weight)

    def calibrate(self, values: NDArray[np.uint8], person: NDArray[np.uint8]) -> None:
        """
        Learn what the values of the map mean, see :meth:`Cue.calibrate`.

        From a mask that the map does not agree with nothing is learnt: either may be wrong, and
        what the map meant before is what can tell.
        """
        if self._agrees:
            self._grades.add_mask(values, person)


def _reduced(
    image: NDArray[Any], scale: float, corner: Shift, size: tuple[int, int]
) -> NDArray[np.float32]:
    """Return a part of an image at a smaller scale, its rim outside of it, (h, w) float32."""
    side = 2 * round(0.5 / scale) + 1
    # What the part is made of, as far as it is inside.
    (left, top), (columns, rows) = corner, size
    x = min(max(int(left) - side, 0), image.shape[1] - 1)
    y = min(max(int(top) - side, 0), image.shape[0] - 1)
    right = max(math.ceil(left + columns / scale) + side, x + 1)
    bottom = max(math.ceil(top + rows / scale) + side, y + 1)
    move = np.array([[1 / scale, 0, left - x], [0, 1 / scale, top - y]])
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    soft = cv2.blur(image[y:bottom, x:right], (side, side))
    small = cv2.warpAffine(soft, move, size, flags=flags, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(small, np.float32)


def _peak(values: Sequence[float] | NDArray[np.float64], at: int) -> float:
    """Return where the parabola through the greatest of some values and its neighbours peaks."""
    if not 0 < at < len(values) - 1:
        return float(at)
    before, here, after = (float(value) for value in values[at - 1 : at + 2])
    bend = before - 2 * here + after
    return at + (0.5 * (before - after) / bend if bend < 0 else 0.0)
