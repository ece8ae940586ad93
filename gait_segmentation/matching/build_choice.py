# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which of several builds is searched."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.kernels import kernel
from gait_segmentation.matching.builds import builds_of
from gait_segmentation.matching.config import MatchingConfig
from gait_segmentation.matching.placements import Sampled
from gait_segmentation.matching.subgrid import State
from gait_segmentation.matching.tanimoto import WindowGrid
from gait_segmentation.matching.transitions import turned
from gait_segmentation.matching.views import Views

__all__ = ['BuildChoice']

_PHASES = 2
"""Phases to either side of the path's in which builds are compared."""
_MOVES = ((-1, 0), (1, 0), (0, -1), (0, 1))
"""Moves of the placement by rows and columns in which builds are compared."""


class BuildChoice:
    """
    Decides which builds are searched.

    A person's build does not change, so all are searched in the first frame of a path and then
    only one.  The others are compared with it where the path leads, in the views, phases and
    placements next to it, which costs next to nothing.  At first the one that has fitted best so
    far is searched, as a single frame says little; later one that fits clearly better for long
    takes over.
    """

    def __init__(
        self,
        bank: TemplateBank,
        templates: NDArray[np.uint8],
        views: Views,
        windows: WindowGrid,
        config: MatchingConfig,
    ) -> None:
        """
        Begin with all builds.

        :param templates: (V * P, H, W) uint8, those that are matched.
        :param windows: the placements of one body height.
        """
        self._config = config
        self._templates = templates.reshape(*bank.templates.shape)
        self.of_sequence = builds_of(bank)
        self.count = int(self.of_sequence.max()) + 1
        self._alike = np.array(
            [
                [_nearest(bank, view, self.of_sequence == build) for build in range(self.count)]
                for view in range(bank.sequences)
            ]
        )
        self._around = np.array(
            [[view, *views.beside(view)] for view in range(bank.sequences)], np.int64
        )
        self._windows = windows
        self.reset()

    def reset(self) -> None:
        """Search all builds in the next frame."""
        self.only: int | None = None
        self._since = self._last = 0.0
        self._lead = np.zeros(self.count)

    @property
    def active(self) -> NDArray[np.bool_]:
        """Return which builds to search in the next frame, (builds,) bool."""
        active = np.full(self.count, self.only is None)
        if self.only is not None:
            active[self.only] = True
        return active

    def update(self, sampled: Sampled, leader: State, seconds: float) -> None:
        """
        Compare the builds in a frame.

        :param sampled: the likelihood about the box.
        :param leader: where the path leads.
        :param seconds: time of the frame, later than the last one's.
        """
        if self.only is None:
            self.only = int(self.of_sequence[leader[0]])
            self._since = self._last = seconds
        if self.count == 1:
            return
        found = np.array([self._similarity(sampled, leader, k) for k in range(self.count)])
        kept = math.exp(-(seconds - self._last) / self._config.build_trial)
        self._lead = kept * self._lead + (1 - kept) * (found - found[self.only])
        self._last = seconds
        settled = seconds - self._since >= self._config.build_trial
        best = int(self._lead.argmax())
        if self._lead[best] > (self._config.build_lead if settled else 0.0):
            self.only = best
            self._lead -= self._lead[best]

    def _similarity(self, sampled: Sampled, leader: State, build: int) -> float:
        """Return the best similarity of a build near a state of the path."""
        known = sampled.known
        return float(
            _best_near(
                self._templates,
                self._around[self._alike[leader[0], build]],
                leader[1],
                leader[3:],
                (self._windows.rows, self._windows.columns, self._windows.step),
                sampled.images[leader[2]],
                sampled.images[leader[2]] if known is None else known[leader[2]],
                known is None,
            )
        )


def _nearest(bank: TemplateBank, view: int, among: NDArray[np.bool_]) -> int:
    """Return which of some sequences is seen most nearly as another one is."""
    away = [abs(turned(float(azimuth) - float(bank.azimuth[view]))) for azimuth in bank.azimuth]
    return int(np.where(among, away, np.inf).argmin())


@kernel('u1[:,:,:,::1], i8[::1], i8, UniTuple(i8, 2), UniTuple(i8, 3), u1[:,::1], u1[:,::1], b1')
def _best_near(  # type: ignore[no-untyped-def]
    templates, views, phase, place, windows, image, known, all_known
):
    """
    Return the largest similarity near a state: of views and phases first, then of placements.

    :param templates: (V, P, H, W) uint8.
    :param views: sequences to compare, in the phases about ``phase``.
    :param place: row and column of the placement.
    :param windows: rows, columns and step of all placements.
    :param known: (h, w) uint8, like ``image``.
    """
    phases = templates.shape[1]
    rows, columns, step = windows
    row, column = place
    found, best = np.float32(-1.0), templates[views[0], phase]
    for view in views:
        for off in range(-_PHASES, _PHASES + 1):
            template = templates[view, (phase + off) % phases]
            value = _tanimoto(template, image, known, all_known, step * row, step * column)
            if value > found:
                found, best = value, template
    for down, right in _MOVES:
        y, x = row + down, column + right
        if 0 <= y < rows and 0 <= x < columns:
            value = _tanimoto(best, image, known, all_known, step * y, step * x)
            found = max(found, value)
    return found


@kernel()
def _tanimoto(template, image, known, all_known, top, left):  # type: ignore[no-untyped-def]
    """Return the similarity of a template at a place over the known pixels."""
    height, width = template.shape
    common, total = np.int32(0), np.int32(0)
    for y in range(height):
        values, line = image[top + y, left : left + width], template[y]
        mask = known[top + y, left : left + width]
        for x in range(width):
            own = line[x] if all_known else line[x] & mask[x]
            common = np.int32(common + np.int32(min(own, values[x])))
            total = np.int32(total + np.int32(own) + np.int32(values[x]))
    return np.float32(common) / np.float32(max(total - common, np.int32(1)))
