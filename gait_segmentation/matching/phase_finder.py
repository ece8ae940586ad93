# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The phase of a walker whose view and place are known about."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import BodyFrame
from gait_segmentation.matching.clock import PhaseClock
from gait_segmentation.matching.config import MatchingConfig
from gait_segmentation.matching.evidence import FineEvidence
from gait_segmentation.matching.fine_views import FineViews
from gait_segmentation.matching.steady import SteadyAngle
from gait_segmentation.matching.steady_body import SteadyBody

__all__ = ['PhaseFinder']

_LEAVES = 0.8
"""Share of the views to a side by which the path's view may leave their middle."""


class PhaseFinder:
    """
    Compares phases about where a path leads, and lets a clock put frame to frame.

    From the front the path's view is 4 to 9 degrees off and its place and height a per cent,
    which is more than the phases differ by.  So views, heights and rows about it are compared as
    well and found together with the phase.
    """

    def __init__(
        self, views: FineViews, evidence: FineEvidence, phases: int, config: MatchingConfig
    ) -> None:
        """
        Take what is shared.

        :param views: closely spaced views.
        :param evidence: the comparison with them, for this finder alone.
        :param phases: P, phases of a stride.
        """
        self._views, self._evidence = views, evidence
        self._azimuth, self._body = SteadyAngle(), SteadyBody()
        self._clock = PhaseClock(
            phases,
            config.slowest_rate,
            config.fastest_rate,
            config.lag + 1,
            evidence.cells,
        )
        self.reset()

    def reset(self) -> None:
        """Forget the walker."""
        self._azimuth.reset()
        self._body.reset()
        self._clock.reset()
        self._middle: float | None = None

    def update(
        self,
        likelihood: NDArray[np.uint8],
        known: NDArray[np.uint8] | None,
        body: BodyFrame,
        view: tuple[str, float],
        phase: int,
        seconds: float,
    ) -> None:
        """
        Take in a frame.

        :param likelihood: (h, w) uint8.
        :param known: (h, w) uint8, 0 where the likelihood says nothing; None = known everywhere.
        :param body: where the path leads, in the likelihood's pixels.
        :param view: build and azimuth there.
        :param phase: phase there.
        :param seconds: time of the frame, later than the last one's.
        """
        build, azimuth = view
        azimuth = self._azimuth.update(azimuth, seconds)
        body = self._body.update(body, seconds)
        views = self._views
        middle = views.place(build, azimuth if self._middle is None else self._middle)
        moved = views.steps(build, middle, views.place(build, azimuth))
        if abs(moved) > 2 * views.reach:
            # Nobody turns that fast, but walking towards and away look alike.
            mirrored = views.steps(build, middle, views.place(build, -azimuth))
            moved = min(moved, mirrored, key=abs)
        if abs(moved) <= _LEAVES * views.reach:
            moved = 0
        middle += moved
        self._middle = views.azimuth(build, middle)
        wanted = self._clock.likely(seconds, moved)
        evidence = self._evidence.at(
            likelihood, known, body, views.around(build, middle), phase, wanted
        )
        self._clock.update(evidence, seconds, moved)

    @property
    def rate(self) -> float:
        """Return the expected rate in strides per second, 0 before the first frame."""
        return self._clock.rate

    def beliefs(self, frames: int) -> NDArray[np.float64]:
        """Return (frames, P) float64, probabilities of the phases in the last frames."""
        return self._clock.beliefs(frames)
