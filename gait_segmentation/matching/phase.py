# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The phase of a walker whose view and place are known approximately."""

from __future__ import annotations

import dataclasses
import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.geometry import BodyFrame
from gait_segmentation.matching.config import MatchingConfig
from gait_segmentation.matching.phase_evidence import FineEvidence, fine_views
from gait_segmentation.matching.phase_filter import PhaseFilter


class PhaseFinder:
    """
    Compares phases about where a path leads, and lets a clock put frame to frame.

    From the front the path's view is 4 to 9 degrees off and its place and height a per cent,
    which is more than the phases differ by.  So views, heights and rows about it are compared as
    well and found together with the phase.
    """

    def __init__(self, bank: TemplateBank, config: MatchingConfig) -> None:
        self._views = fine_views(bank)
        self._evidence = FineEvidence(self._views, bank.fill)
        self._body = SteadyBody()
        self.clock = PhaseFilter(
            bank.phases,
            config.slowest_rate,
            config.fastest_rate,
            config.lag + 1,
            self._evidence.cells,
        )
        self._middle: float | None = None

    def add_frame(
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
        body = self._body.smooth(body, seconds)
        views = self._views
        middle = views.place(build, azimuth if self._middle is None else self._middle)
        moved = views.steps(build, middle, views.place(build, azimuth))
        if abs(moved) > 2 * views.reach:
            # No person turns that fast, but walking towards and away are similar.
            mirrored = views.steps(build, middle, views.place(build, -azimuth))
            moved = min(moved, mirrored, key=abs)
        middle += moved
        around = views.around(build, middle)
        self._middle = float(views.azimuths[around[views.reach]])
        wanted = self.clock.predict(seconds, moved)
        self.clock.correct(self._evidence.at(likelihood, known, body, around, phase, wanted))


_FRAMES, _LONGEST_S = 20, 0.8  # how many frames, and how much time, a line is drawn through
# Share of the height, of the place or of the height itself, from which on a body has jumped.
_JUMP = 0.25
# Time in which a motion must show to be trusted, across, down and in height: seconds that stand
# still are added.  Walkers cross the image faster than they sink or grow in it.
_STILL = (0.04, 0.12, 0.12)


class SteadyBody:
    """
    Draws a straight line through the last places and heights of a body.

    A place of its own for every frame is a per cent of the height off, as much as a head rises
    and falls in a step.
    """

    def __init__(self) -> None:
        self._last: deque[tuple[float, float, float, float]] = deque(maxlen=_FRAMES)

    def smooth(self, body: BodyFrame, seconds: float) -> BodyFrame:
        """Return the smoothed body of a frame, whose time is later than the last one's."""
        size = math.log(body.height)
        if self._last:
            _, x, y, tall = self._last[-1]
            away = math.hypot(body.center_x - x, body.center_y - y)
            if away > _JUMP * body.height or abs(size - tall) > _JUMP:
                self._last.clear()
        self._last.append((seconds, body.center_x, body.center_y, size))
        while seconds - self._last[0][0] > _LONGEST_S:
            self._last.popleft()
        # A few numbers: lists are faster than arrays.
        count = len(self._last)
        times, *places = zip(*self._last, strict=True)
        middle = sum(times) / count
        since = [each - middle for each in times]
        square = sum(each * each for each in since)
        smooth = []
        for place, still in zip(places, _STILL, strict=True):
            slope = sum(t * p for t, p in zip(since, place, strict=True))
            slope /= square + count * still**2
            smooth.append(sum(place) / count + slope * since[-1])
        x, y, tall = smooth
        return dataclasses.replace(body, center_x=x, center_y=y, height=math.exp(tall))


# Cosine of the azimuth above which it can be seen which leg is nearer.
_TURNED = math.cos(math.radians(60.0))
# Strides by which a phase may lie behind the last one and be taken for a stand-still.
_WAITS = 0.25


class NearLeg:
    """
    Counts the stride from the leg nearer to the camera, and never backwards.

    Seen from the front or back neither leg is nearer.  Within 30 degrees of the camera's axis the
    leg therefore stays the one it was, so that the phase goes on while the view wavers about the
    axis; a person who turns from one side to the other changes legs, half a stride, once.
    """

    def __init__(self) -> None:
        self._right: bool | None = None
        self._last: float | None = None
        self._before: tuple[float, float] | None = None

    def expected(self, seconds: float, rate: float, first: float) -> float:
        """
        Return the phase of the right leg that a steady walk leads to.

        :param seconds: time of the frame.
        :param rate: strides per second.
        :param first: what is expected of the first frame.
        """
        if self._before is None:
            return first
        phase, then = self._before
        return phase + rate * (seconds - then)

    def phase_of(self, phase: float, azimuth: float, seconds: float) -> float:
        """
        Return the phase of a frame, in [0, 1).

        Phases up to a quarter of a stride behind the last one wait for it: people do not walk
        backwards, so the estimate was ahead.  Others are jumps, taken as they are.

        :param phase: strides, 0 = heel contact of the right leg.
        :param azimuth: direction of walking in radians, 0 to the right in the image.
        :param seconds: time of the frame.
        """
        self._before = phase, seconds
        across = math.cos(azimuth)
        if self._right is None or abs(across) > _TURNED:
            self._right = across > -1e-9
        phase = (phase if self._right else phase + 0.5) % 1.0
        if self._last is not None and 0 < (self._last - phase) % 1.0 < _WAITS:
            phase = self._last
        self._last = phase
        return phase


_TOLERANCE = 0.05  # strides to either side of a phase that is called right


def phase_near(belief: NDArray[np.float64], phase: float) -> tuple[float, float]:
    """
    Return the mean phase of a belief, apart from half strides, and the probability of it.

    :param belief: (P,) float64, probabilities of the phases 0, 1 / P, ...; halves of a stride are
        laid over one another.
    :param phase: strides; of the two halves the one nearer to this is taken.
    :returns: the phase in [0, 1), and the probability that it is right to 5 % of a stride, apart
        from half strides, in 0..1.
    """
    at = np.arange(len(belief)) / len(belief)
    # On a circle of half a stride.
    mean = float(np.angle(belief @ np.exp(4j * np.pi * at))) / (4 * math.pi)
    mean += round(2 * (phase - mean)) / 2
    away = np.abs((at - mean + 0.25) % 0.5 - 0.25)
    # A bin that reaches over the tolerance counts by the share of it within.
    share = np.clip((_TOLERANCE - away) * len(belief) + 0.5, 0.0, 1.0)
    mean %= 1.0
    # What is next to nothing below 0 comes out as 1.
    return (mean if mean < 1.0 else 0.0), float(belief @ share)
