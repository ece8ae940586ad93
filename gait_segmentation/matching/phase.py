# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The phase of a walker's stride, and its rate, as a probability that an even walk carries along.

From the front the view of the path is 4 to 9 degrees off and its place and height a per cent,
which is more than the phases differ by, and one frame says next to nothing of them.  So views,
heights and rows about the path's are compared as well and found together with the phase, from
frame to frame.
"""

from __future__ import annotations

import dataclasses
import math
from collections import deque
from functools import lru_cache
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank, fine_grid
from gait_segmentation.geometry import BodyFrame
from gait_segmentation.kernels import kernel
from gait_segmentation.matching.config import MatchingConfig
from gait_segmentation.matching.path import WIDEST_TURN, Views
from gait_segmentation.matching.placements import antialiasing_side, resampled

HEIGHTS = (0.975, 1.0, 1.025)
"""Factors on the height of the body that are compared."""

# Rows half a pixel of the views apart that are compared.  Of as many columns the best one counts.
_ROWS = 3
_ERROR = math.radians(7.0)  # by how much the view a path begins with is wrong, standard deviation
_SPARE = 2  # samples about the grid on each side, by which it can be shifted
# Least difference of the mean likelihoods inside and outside that tells anything.
_LEAST_CONTRAST = 0.05 * 255
_HIGHEST = 255

_RATES = 14  # rates of the grid, the first of which is standing
_RATE_DIFFUSION = 0.1  # standard deviation by which the logarithm of the rate changes in a second
# Share of the belief that returns to the prior in a second: people stop, or the view is wrong.
_RENEWAL = 0.02
# Evidence that is worth a factor of e.  Flipped pixels alone would give about 8; errors of real
# likelihoods are alike in neighbouring pixels.
_EVIDENCE_NOISE = 12.0
# Share of the belief in a view, height or row that goes to each neighbour in a second.
_CELL_DIFFUSION = 2.0
_UNLIKELY = 3e-3  # views and placements less likely than this are not compared
# Share of the belief that is spread over all views and placements when the views are moved.
_ANYWHERE = 0.01
_LATER_S = 0.5  # after which frames tell nothing more of an earlier one, as synthetic walkers show
_LEAST_WORTH = float(np.exp(-12.0))  # no frame is worth more than this

# Time in which a motion must show to be trusted, across, down and in height: seconds that stand
# still are added.  Walkers cross the image faster than they sink or grow in it.
_STILL = (0.04, 0.12, 0.12)

FloatArray = NDArray[np.float32]
Belief = NDArray[np.float64]


class _Step(NamedTuple):
    """A frame: the step to it, its likelihoods (*cells, P), and the belief then (*cells, R, P)."""

    seconds: float
    passed: float
    moved: int
    likelihood: Belief
    belief: Belief


class PhaseFilter:
    """
    A grid filter over phase, rate, view and placement (hidden Markov model, forward and backward).

    The path, which goes where the scores are best, stalls and jumps where a walker is seen from
    the front.  A walk is even, however: with the rate as a part of the state, little evidence adds
    up over seconds.  The phase advances by rate x time; turning by fractions of a bin is exact in
    the frequency domain.  View and placement, the cells of the grid, nearly stay.
    """

    def __init__(self, bank: TemplateBank, config: MatchingConfig) -> None:
        """Lay out the grid for the walkers of a bank, with as many frames as results may lag."""
        self._views, self._fill, phases = _fine_views(bank), bank.fill, bank.phases
        fastest = config.fastest_rate
        walking = np.geomspace(max(config.slowest_rate, 0.1 * fastest), fastest, _RATES - 1)
        self._rates = np.concatenate([[0.0], walking])
        # Adults go at 110 steps/min; one in twenty people stands.
        prior = np.exp(-0.5 * (np.log(walking / 0.92) / 0.2) ** 2)
        prior = np.concatenate([[0.05], (1 - 0.05) * prior / prior.sum()])
        self._prior = np.repeat(prior[:, None], phases, axis=1) / phases
        self._waves = 2 * np.pi * np.arange(phases // 2 + 1)
        # Usually 0.08; not zero where the slowest and the fastest walk are as good as one.
        self._spacing = max(float(np.log(walking[1] / walking[0])), 1e-6)
        self._steps: deque[_Step] = deque(maxlen=config.lag + 1)
        self._body = SteadyBody()
        self._chosen: tuple[int, ...] = ()
        self._near_leg = NearLeg()
        self._before: tuple[float, float] | None = None

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
        body = self._body.smooth(body, seconds)
        moved = self.choose(*view)
        wanted = self.predict(seconds, moved)
        self.correct(self.evidence(likelihood, known, body, phase, wanted))

    def choose(self, build: str, azimuth: float) -> int:
        """Turn to the views about an azimuth, and return by how many they go on."""
        last = self._views.azimuths[self._chosen[self._views.reach]] if self._chosen else azimuth
        views, moved = self._views.around(build, azimuth, float(last))
        if views != self._chosen:
            # The used part of their templates, of at least one pixel, in 0..1.
            chosen = self._views.templates[list(views)]
            left, top, width, height = cv2.boundingRect(chosen.max(axis=(0, 1)))
            self._part = top, left, max(height, 1), max(width, 1)
            used = chosen[:, :, top : top + self._part[2], left : left + self._part[3]]
            flat = used.astype(np.float32) / _HIGHEST
            self._templates = np.ascontiguousarray(flat.reshape(*flat.shape[:2], -1))
            self._squares = (self._templates**2).sum(axis=2)
            self._chosen = views
        return moved

    def evidence(
        self,
        likelihood: NDArray[np.uint8],
        known: NDArray[np.uint8] | None,
        body: BodyFrame,
        phase: int,
        wanted: NDArray[np.bool_],
    ) -> Belief:
        """
        Return how well the phases of the chosen views fit at placements about a body.

        In the Tanimoto similarity, which favours large templates where the surroundings are not
        black, differences as small as those between phases seen from the front drown.  Here the
        likelihood is scaled so that the person is 1 and the surroundings 0 on average, and
        compared by half the sum of squared differences: the logarithm of the probability for
        independent errors of the pixels.  It is sampled at half pixels of the views.

        :param phase: one that fits the middle view, by which person and surroundings are told
            apart; the other parameters are as in :meth:`add_frame`.
        :param wanted: (V, S, Y) bool, views, heights and rows to compare.
        :returns: (V, S, Y, P) float64, up to a constant, in quarters of the views' pixels at the
            height of ``body``; -inf where not wanted.  Zeros if nothing is known.
        """
        rows, columns = (2 * side for side in self._views.templates.shape[2:])
        grids = HEIGHTS, (rows + 2 * _SPARE, columns + 2 * _SPARE), self._fill * rows
        side = antialiasing_side(body.height / grids[-1])
        # From each half pixel of the views on, the mean over a pixel of them.
        images, masks = resampled(likelihood, known, body, *grids, side)
        values = _paired(images)
        seen = None if masks is None else _paired(masks) / np.float32(_HIGHEST)
        middle, inner = HEIGHTS.index(1.0), slice(_SPARE, -_SPARE, 2)
        levels = _levels(
            values[middle, inner, inner],
            None if seen is None else seen[middle, inner, inner],
            self._views.templates[self._chosen[self._views.reach], phase],
        )
        shape = (*wanted.shape, self._squares.shape[1])
        if levels is None:
            return np.zeros(shape)
        result = np.full(shape, -np.inf)
        weights = 4 * np.square(HEIGHTS)
        given = values, values[:0] if seen is None else seen, levels, self._part, wanted
        _compare(self._templates, self._squares, *given, weights, result)
        return result

    def predict(self, seconds: float, moved: int = 0) -> NDArray[np.bool_]:
        """
        Predict the next frame, and return which cells, views and placements, are to be compared.

        :param seconds: its time, later than the last frame's.
        :param moved: by how many views the person has turned since the last frame.
        :returns: (V, S, Y) bool.
        """
        if not self._steps:
            self._next = seconds, 0.0, moved
            return self._views.cells > 0
        last = self._steps[-1]
        passed = seconds - last.seconds
        self._next = seconds, passed, moved
        self._predicted = diffused(_moved(last.belief, moved), passed)
        share = self._predicted.sum(axis=(-2, -1))
        return np.asarray(share > _UNLIKELY * share.sum())

    def correct(self, evidence: Belief) -> None:
        """Correct the belief by the :meth:`evidence` (V, S, Y, P) of the frame predicted."""
        likelihood = np.exp((evidence - evidence.max()) / _EVIDENCE_NOISE)
        # No phase of a view that was compared is ruled out by one frame; of others nothing is
        # left.
        likelihood = np.where(np.isfinite(evidence), np.maximum(likelihood, _LEAST_WORTH), 0.0)
        if self._steps:
            turn, share, kept = self._transition(self._next[1])
            belief = np.zeros(self._predicted.shape)
            compared = likelihood.any(axis=-1)
            before = self._predicted[compared]
            predicted = np.empty_like(before)
            exchange(before, share, 1, predicted)
            predicted = _turned(predicted, turn)
            restarted = (1 - kept) * predicted.sum(axis=(1, 2), keepdims=True)
            predicted = kept * predicted + restarted * self._prior
            belief[compared] = predicted * likelihood[compared][:, None]
        else:
            belief = self._views.cells[..., None, None] * self._prior * likelihood[..., None, :]
        belief /= belief.sum()
        self._steps.append(_Step(*self._next, likelihood, belief))

    @property
    def rate(self) -> float:
        """Return the expected rate in strides per second."""
        return float(self._steps[-1].belief.sum(axis=(0, 1, 2, 4)) @ self._rates)

    def phase(self, back: int, expected: float, azimuth: float) -> tuple[float, float]:
        """
        Return the phase of a frame, in [0, 1), of the leg nearer to the camera.

        Frames are asked for in their order: the phase of each goes on from the last one's.

        :param back: 0 = the newest frame, 1 = the one before.
        :param expected: strides, what is expected of the first frame.
        :param azimuth: direction of walking in radians, 0 to the right in the image.
        :returns: the phase, and the probability that it is right to 5 % of a stride, apart from
            half strides, in 0..1.
        """
        seconds = self._steps[-1 - back].seconds
        if self._before is not None:
            phase, then = self._before
            expected = phase + self.rate * (seconds - then)
        phase, sure = phase_near(self.belief(back), expected)
        self._before = phase, seconds
        return self._near_leg.phase_of(phase, azimuth), sure

    def belief(self, back: int = 0) -> Belief:
        """
        Return the probabilities of the phases in a frame, (P,) float64, from later ones as well.

        What comes more than half a second later tells nothing more of it.

        :param back: 0 = the newest frame, 1 = the one before.
        """
        first, *others = list(self._steps)[-1 - back :]
        later: Belief | float = 1.0
        for step in reversed(others):
            if step.seconds <= first.seconds + _LATER_S:
                later = self._back(step, later)
        belief = (first.belief * later).reshape(-1, first.belief.shape[-1]).sum(axis=0)
        return np.asarray(belief / belief.sum())

    def _back(self, step: _Step, later: Belief | float) -> Belief:
        """Carry the likelihood of all later frames (..., R, P) to the frame before a step."""
        turn, share, kept = self._transition(step.passed)
        seen = np.broadcast_to(later * step.likelihood[..., None, :], step.belief.shape)
        # Backward it is the transpose: the exchange is its own, that of a turn its conjugate.
        turned = _turned(seen, turn.conj())
        back, shape = np.empty_like(turned), (-1, *turned.shape[-2:])
        exchange(turned.reshape(shape), share, 1, back.reshape(shape))
        renewed = (self._prior * seen).sum(axis=(-2, -1), keepdims=True)
        back = kept * back + (1 - kept) * renewed
        back = _moved(diffused(back, step.passed), -step.moved)
        return np.asarray(back / back.max())

    def _transition(self, passed: float) -> tuple[NDArray[np.complex128], float, float]:
        """Return the turns of the rates (R, P / 2 + 1), share exchanged, and share not renewed."""
        turn = np.exp(-1j * np.outer(self._rates * passed, self._waves))
        share = min(0.3, 0.5 * _RATE_DIFFUSION**2 * passed / self._spacing**2)
        return np.asarray(turn), share, math.exp(-_RENEWAL * passed)


def phase_near(belief: Belief, phase: float) -> tuple[float, float]:
    """
    Return the mean phase of a belief, in [0, 1), and the probability that it is right, in 0..1.

    Halves of a stride are laid over one another, and the one nearer to a phase is taken.
    """
    at = np.arange(len(belief)) / len(belief)
    # On a circle of half a stride.
    mean = float(np.angle(belief @ np.exp(4j * np.pi * at))) / (4 * math.pi)
    mean += round(2 * (phase - mean)) / 2
    away = np.abs((at - mean + 0.25) % 0.5 - 0.25)
    # A bin that reaches over the tolerance counts by the share of it within.
    share = np.clip((0.05 - away) * len(belief) + 0.5, 0.0, 1.0)
    mean %= 1.0
    # What is next to nothing below 0 comes out as 1.
    return (mean if mean < 1.0 else 0.0), float(belief @ share)


class NearLeg:
    """
    Counts the stride from the leg nearer to the camera, and never backwards.

    Within 30 degrees of the camera's axis the leg stays the one it was, so that the phase goes on
    while the view wavers; who turns from one side to the other changes legs, half a stride, once.
    """

    def __init__(self) -> None:
        self._right: bool | None = None
        self._last: float | None = None

    def phase_of(self, phase: float, azimuth: float) -> float:
        """
        Return the phase of a frame, in [0, 1).

        Phases up to a quarter of a stride behind the last one wait for it: people do not walk
        backwards, so the estimate was ahead.  Others are jumps, taken as they are.

        :param phase: strides, 0 = heel contact of the right leg.
        :param azimuth: direction of walking in radians, 0 to the right in the image.
        """
        across = math.cos(azimuth)
        if self._right is None or abs(across) > math.cos(math.radians(60.0)):
            self._right = across > -1e-9
        phase = (phase if self._right else phase + 0.5) % 1.0
        if self._last is not None and 0 < (self._last - phase) % 1.0 < 0.25:
            phase = self._last
        self._last = phase
        return phase


class SteadyBody:
    """
    Draws a straight line through places and heights of a body in the last 0.8 s.

    A place of its own for every frame is a per cent of the height off, as much as a head rises
    and falls in a step.
    """

    def __init__(self) -> None:
        self._last: deque[tuple[float, float, float, float]] = deque(maxlen=20)

    def smooth(self, body: BodyFrame, seconds: float) -> BodyFrame:
        """Return the smoothed body of a frame, whose time is later than the last one's."""
        size = math.log(body.height)
        if self._last:
            _, x, y, tall = self._last[-1]
            away = math.hypot(body.center_x - x, body.center_y - y)
            # It has jumped.
            if away > 0.25 * body.height or abs(size - tall) > 0.25:
                self._last.clear()
        self._last.append((seconds, body.center_x, body.center_y, size))
        while seconds - self._last[0][0] > 0.8:
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


class FineViews(Views):
    """
    The walkers of a bank, in its finer views if it has such.

    Views 22.5 degrees apart are too coarse for the phase of a person seen from the front, and so
    is blending them.  Nothing is written after making, so that matchers may share it.
    """

    def __init__(self, bank: TemplateBank) -> None:
        """Take the finer views, or those that the bank is searched by."""
        super().__init__(bank.finer or bank)
        self.templates = (bank.finer or bank).templates
        """(V, P, h, w) uint8 in the grid of ``fine_grid``."""
        if bank.finer is None:
            grid = fine_grid(bank.grid)
            flat = self.templates.reshape(-1, *bank.grid)
            # An average where they shrink.
            small = [cv2.resize(one, grid[::-1], interpolation=cv2.INTER_AREA) for one in flat]
            self.templates = np.stack(small).reshape(bank.sequences, bank.phases, *grid)
        rings = [self.azimuths[ring] for ring in self.rings.values()]
        widest = max(np.diff(ring, append=ring[0] + 2 * math.pi).max() for ring in rings)
        count = min(map(len, rings))
        reach = 1 if bank.finer is None else 3
        self.reach = 0 if widest > WIDEST_TURN else min(reach, (count - 1) // 2)
        """How many views to either side are compared."""
        self._sides = np.arange(-self.reach, self.reach + 1)
        likely = np.exp(-0.5 * (2 * math.pi / count * self._sides / _ERROR) ** 2)
        cells = np.tile(likely[:, None, None], (1, len(HEIGHTS), _ROWS))
        self.cells = cells / cells.sum()
        """(2 reach + 1, heights, rows) float64, how likely views seen once and placements are."""

    def around(self, build: str, azimuth: float, last: float) -> tuple[tuple[int, ...], int]:
        """
        Find the views about an azimuth in the ring of a build.

        :param last: azimuth of the view that was the middle one before.
        :returns: their indices, clockwise ones first, and by how many they lie anticlockwise of
            those before.
        """
        ring = self.rings[build]
        count, azimuths = len(ring), self.azimuths[ring]

        def place(direction: float) -> int:
            return int(np.cos(azimuths - direction).argmax())

        def steps(direction: float) -> int:
            return (place(direction) - middle + count // 2) % count - count // 2

        middle = place(last)
        moved = steps(azimuth)
        if abs(moved) > 2 * self.reach:
            # No person turns that fast, but walking towards and away are similar.
            moved = min(moved, steps(-azimuth), key=abs)
        return tuple(ring[(middle + moved + self._sides) % count].tolist()), moved


# Those of the last banks are kept.
_fine_views = lru_cache(maxsize=2)(FineViews)


def _levels(
    values: FloatArray, seen: FloatArray | None, template: NDArray[np.uint8]
) -> tuple[float, float] | None:
    """Return mean likelihoods well inside the person and well outside, None if too alike."""
    if seen is not None:
        # The values are 0 where nothing is known; where half is, they are half as large.
        values = values / np.maximum(seen, np.float32(0.25))
    means = []
    around = np.ones((3, 3), np.uint8)
    for part in (cv2.erode(template, around), _HIGHEST - cv2.dilate(template, around)):
        weight = part.astype(np.float32) if seen is None else part * seen
        area = float(weight.sum())
        if area < _HIGHEST:
            return None
        means.append(float((weight * values).sum()) / area)
    person, ground = means
    return (person, ground) if person - ground >= _LEAST_CONTRAST else None


def _paired(images: NDArray[np.uint8]) -> FloatArray:
    """Return the means of the 2 x 2 pixels from each pixel on."""
    return np.stack([cv2.boxFilter(each, cv2.CV_32F, (2, 2), anchor=(0, 0)) for each in images])


def _turned(belief: NDArray[np.float64], turn: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Move the phases of each rate, (..., R, P), on by a spectrum."""
    result = np.fft.irfft(np.fft.rfft(belief) * turn, belief.shape[-1])
    # A sharp peak turned by a fraction of a bin rings below 0.
    return np.asarray(np.maximum(result, 0.0))


def _moved(belief: NDArray[np.float64], steps: int) -> NDArray[np.float64]:
    """Take a belief to views that lie ``steps`` farther on; new views get what all have."""
    if steps == 0:
        return belief
    views = len(belief)
    everywhere = belief.mean(axis=(0, 1, 2), keepdims=True)
    result = np.zeros_like(belief)
    if abs(steps) < views:
        low, high = max(0, -steps), min(views, views - steps)
        result[low:high] = belief[low + steps : high + steps]
    return (1 - _ANYWHERE) * result + _ANYWHERE * everywhere


@kernel('f8[:,:,::1], f8, i8, f8[:,:,::1]')
def exchange(before, share, first, after):  # type: ignore[no-untyped-def]
    """
    Let neighbours along the middle axis exchange a share of their difference; its own adjoint.

    :param before: float64, and ``after`` likewise, written.
    :param first: from which one on.
    """
    count = before.shape[1]
    for outer in range(len(before)):
        for place in range(count):
            old, new = before[outer, place], after[outer, place]
            new[:] = old
            if first <= place < count - 1:
                following = before[outer, place + 1]
                for j in range(len(old)):
                    new[j] += share * (following[j] - old[j])
            if place > first:
                last = before[outer, place - 1]
                for j in range(len(old)):
                    new[j] -= share * (old[j] - last[j])


@kernel('f8[:,:,:,:,::1], f8')
def diffused(belief, seconds):  # type: ignore[no-untyped-def]
    """Let neighbouring views, heights and rows, the first axes, exchange a share, in a copy."""
    share = min(0.3, _CELL_DIFFUSION * seconds)
    one, other = np.empty_like(belief), np.empty_like(belief)
    views, heights, rows, rates, phases = belief.shape
    rest = rates * phases
    shape = 1, views, heights * rows * rest
    exchange(belief.reshape(shape), share, 0, one.reshape(shape))
    shape = views, heights, rows * rest
    exchange(one.reshape(shape), share, 0, other.reshape(shape))
    shape = views * heights, rows, rest
    exchange(other.reshape(shape), share, 0, one.reshape(shape))
    return one


@kernel(
    'f4[:,:,::1], f4[:,::1], f4[:,:,::1], f4[:,:,::1], UniTuple(f8, 2), UniTuple(i8, 4), '
    'b1[:,:,::1], f8[::1], f8[:,:,:,::1]',
    fastmath=True,
)
def _compare(  # type: ignore[no-untyped-def]
    templates, squares, values, seen, levels, part, wanted, weights, result
):
    """Put minus half the least sums of squared differences of the templates into ``result``."""
    # Not by matrix products: those of BLAS wait for each other's threads where cores are busy.
    top, left, height, width = part
    person, ground = np.float32(levels[0]), np.float32(levels[1])
    scale, half, all_seen = np.float32(1) / (person - ground), np.float32(0.5), len(seen) == 0
    # One for each column; the best one counts.
    lines = np.empty((3, height * width), np.float32)
    shown = np.ones((3, height * width), np.float32)
    for tall in range(len(values)):
        for down in range(3):
            if not wanted[:, tall, down].any():
                continue
            for across in range(3):
                place = (
                    _SPARE + 2 * top + down - 1,
                    _SPARE + 2 * left + across - 1,
                    width,
                )
                _cut(values[tall], *place, lines[across])
                if not all_seen:
                    _cut(seen[tall], *place, shown[across])
                line, visible = lines[across], shown[across]
                for j in range(len(line)):
                    line[j] = (line[j] - ground * visible[j]) * scale
            for view in range(len(templates)):
                if not wanted[view, tall, down]:
                    continue
                for phase in range(templates.shape[1]):
                    own = templates[view, phase]
                    first, second, third = _products(own, lines)
                    if all_seen:
                        best = max(first, second, third) - half * squares[view, phase]
                    else:
                        one, two, three = _products(own * own, shown)
                        best = max(first - half * one, second - half * two, third - half * three)
                    result[view, tall, down, phase] = weights[tall] * best


@kernel()
def _cut(image, top, left, width, line):  # type: ignore[no-untyped-def]
    """Put every other pixel of a part of an image, row by row, into a line."""
    for row in range(len(line) // width):
        source, target = image[top + 2 * row], line[row * width :]
        for column in range(width):
            target[column] = source[left + 2 * column]


@kernel(fastmath=True)
def _products(template, lines):  # type: ignore[no-untyped-def]
    """Return the products of a template with three lines."""
    first, second, third = np.float32(0), np.float32(0), np.float32(0)
    for j in range(len(template)):
        first += template[j] * lines[0, j]
        second += template[j] * lines[1, j]
        third += template[j] * lines[2, j]
    return first, second, third
