# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The matching stage: from likelihoods to the path of templates."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import InputError
from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.geometry import Box, Placement, check_matched_box
from gait_segmentation.images import same_proportions
from gait_segmentation.matching.box_motion import BoxMotion
from gait_segmentation.matching.builds import BuildChoice
from gait_segmentation.matching.clock import PhaseClock
from gait_segmentation.matching.coded_bank import coded_bank
from gait_segmentation.matching.confidence import phase_near
from gait_segmentation.matching.config import MatchingConfig
from gait_segmentation.matching.near_leg import NearLeg
from gait_segmentation.matching.path import Areas, Path, PathSearch
from gait_segmentation.matching.placements import PlacementGrid, Sampled
from gait_segmentation.matching.shape_prior import warp_template
from gait_segmentation.matching.steady import SteadyAngle
from gait_segmentation.matching.transitions import turned
from gait_segmentation.results import MatchResult

__all__ = ['SequenceMatcher']


@dataclass(frozen=True)
class _Frame:
    """A frame whose result has not been emitted."""

    stamp_ns: int
    track_id: int
    box: Box
    scale: float
    shape: tuple[int, int]
    sampled: Sampled
    angle: float


class SequenceMatcher:
    """
    Matches the likelihoods of one person to the sequences of a bank.

    Wang, Yagi and Makihara, ACCV 2009, sections 2 and 3.
    """

    def __init__(self, bank: TemplateBank, config: MatchingConfig | None = None) -> None:
        """
        Prepare the templates.

        :param bank: the sequences.
        :param config: parameters; the defaults if None.
        """
        self.config = config or MatchingConfig()
        self._bank = bank
        self._placements = PlacementGrid(bank.grid, bank.fill, self.config)
        self._builds = BuildChoice(bank, self.config)
        coded = coded_bank(bank, self.config.levels, self._placements.windows)
        self._templates, self._kernel, self._visible = (
            coded.templates,
            coded.kernels,
            coded.visible,
        )
        self._evidence = coded.evidence
        self._common = self._kernel.new_rows(len(self._placements.scales))
        self._path = PathSearch(
            bank,
            coded.area,
            self._kernel.row.reshape(-1),
            self._placements.shape,
            self.config.scale_cost * np.abs(np.log(self._placements.scales)),
            self._kernel.pitch,
            self.config,
        )
        self._beside = _neighbours(bank)
        self._motion = BoxMotion()
        self._clock = PhaseClock(
            bank.phases,
            self.config.minimum_cadence / 120,
            self.config.maximum_cadence / 120,
            self.config.lag + 1,
        )
        self._near_leg = NearLeg()
        self._view = SteadyAngle()
        self.reset()

    def reset(self) -> None:
        """Forget all frames, also those whose results have not been emitted."""
        self._stamp_ns = 0
        self._track_id = 0
        self._begin()

    def _begin(self) -> None:
        self._origin_ns = 0
        self._path.reset()
        self._motion.reset()
        self._builds.reset()
        self._waiting: deque[_Frame] = deque()
        self._clock.reset()
        self._near_leg.reset()
        self._view.reset()

    def update(
        self,
        likelihood: NDArray[np.uint8],
        box: Box | None,
        stamp_ns: int,
        *,
        track_id: int,
        source_size: tuple[int, int],
        known: NDArray[np.uint8] | None = None,
        angle: float = 0.0,
    ) -> list[MatchResult]:
        """
        Take in a frame.

        A stamp that goes back resets the matcher.  Another ``track_id``, no box, or a pause
        longer than the window ends the path: the results that the lag holds back are emitted
        and the next frame begins a new path.

        :param likelihood: (h, w) uint8, 255 = surely person, of the source's proportions.
        :param box: tight box of the person in source pixels, not absurdly small, large or far
            away (:func:`~gait_segmentation.geometry.check_matched_box`); None = nobody is tracked.
        :param stamp_ns: the frame's stamp in nanoseconds.
        :param track_id: who is tracked.
        :param source_size: (width, height) of the source image.
        :param known: (h, w) uint8, 0 where the likelihood says nothing, as where something hides
            the person; None = known everywhere.  What is outside of the image is never known.
        :param angle: tilt of the body's axis in radians, positive with the head to the right.
        :returns: the results that are complete now, oldest first.  With a lag of n frames the
            first n calls of a path return nothing.  Without a box, the last one is empty.
        :raises InputError: if a value cannot be used; the state is then as before.
        """
        scale = self._check(likelihood, stamp_ns, source_size, known, angle)
        if box is not None:
            check_matched_box(box, source_size)
        if stamp_ns < self._stamp_ns:
            self.reset()
        elif stamp_ns == self._stamp_ns:
            raise InputError(f'stamp must be later than that of the last frame, got {stamp_ns}')
        results: list[MatchResult] = []
        pause = (stamp_ns - self._stamp_ns) / 1e9
        if box is None or track_id != self._track_id or pause > self.config.window:
            results = self.flush()
        self._stamp_ns, self._track_id = stamp_ns, track_id
        if box is None:
            return [*results, _nobody(stamp_ns, track_id, likelihood.shape)]
        if self._path.frames == 0:
            self._origin_ns = stamp_ns
        self._take_in(likelihood, known, box, scale, angle)
        if len(self._waiting) > self.config.lag:
            belief = self._clock.beliefs(len(self._waiting))[0]
            results.append(self._emit(self._path.follow(), 0, belief))
            self._waiting.popleft()
        return results

    def flush(self) -> list[MatchResult]:
        """Return the results that the lag still holds back, and let the path begin anew."""
        results = []
        if self._waiting:
            path, beliefs = self._path.follow(), self._clock.beliefs(len(self._waiting))
            results = [self._emit(path, index, belief) for index, belief in enumerate(beliefs)]
        self._begin()
        return results

    @staticmethod
    def _check(
        likelihood: NDArray[np.uint8],
        stamp_ns: int,
        source_size: tuple[int, int],
        known: NDArray[np.uint8] | None,
        angle: float,
    ) -> float:
        """Refuse what cannot be used and return the likelihood's scale."""
        for name, array in (('likelihood', likelihood), ('known', known)):
            if array is None:
                continue
            if not isinstance(array, np.ndarray) or array.ndim != 2 or array.dtype != np.uint8:
                raise InputError(
                    f'{name} must be a (height, width) uint8 array, got shape '
                    f'{np.shape(array)} {getattr(array, "dtype", type(array).__name__)}'
                )
            if array.size == 0 or array.shape != likelihood.shape:
                raise InputError(
                    f'{name} must have the size of the likelihood and at least one pixel, got '
                    f'{array.shape} and {likelihood.shape}'
                )
        if stamp_ns <= 0:
            raise InputError(f'stamp must be positive nanoseconds, got {stamp_ns}')
        if not math.isfinite(angle):
            raise InputError(f'angle must be a finite number of radians, got {angle}')
        width, height = source_size
        if width < 1 or height < 1:
            raise InputError(f'source size must be positive, got {width} x {height}')
        if not same_proportions(likelihood.shape, (height, width)):
            raise InputError(
                f'likelihood of {likelihood.shape[1]} x {likelihood.shape[0]} pixels does not '
                f'have the proportions of the source of {width} x {height}'
            )
        return likelihood.shape[1] / width

    def _take_in(
        self,
        likelihood: NDArray[np.uint8],
        known: NDArray[np.uint8] | None,
        box: Box,
        scale: float,
        angle: float,
    ) -> None:
        """Match a frame and take it into the path."""
        grid = self._placements
        sampled = grid.sample(likelihood, known, box.scaled(scale), self.config.blur, angle)
        seconds = (self._stamp_ns - self._origin_ns) / 1e9
        active = self._builds.choose(seconds, self._path.leading)
        common = self._common
        self._kernel.common_rows(sampled.images, active, common)
        scales, rows, lanes = common.shape
        window = np.zeros((scales, lanes), np.int32)
        areas = grid.windows.areas(sampled.images).reshape(scales, -1)
        window[:, : areas.shape[1]] = areas
        visible = np.empty((0, rows, lanes), np.int32)
        if sampled.known is not None:
            visible = self._visible.rows(sampled.known, active, self._builds.of_sequence)
        jump = self._motion.update(box, seconds, grid.shift, grid.log_step)
        self._path.step(
            Areas(common, window.reshape(-1), visible),
            seconds,
            jump,
            active[self._builds.of_sequence],
        )
        sequence, phase, tall, row, column = self._path.leader()
        azimuth = self._azimuth(sequence, self._refine(0, sequence, phase, tall, row, column)[0])
        view = self._view.update(azimuth, seconds)
        self._clock.update(
            self._evidence.at(
                sampled.images[tall],
                None if sampled.known is None else sampled.known[tall],
                (row * grid.windows.step, column * grid.windows.step),
                sequence,
                phase,
                self._towards(sequence, view),
            ),
            seconds,
        )
        self._waiting.append(
            _Frame(
                self._stamp_ns,
                self._track_id,
                box,
                scale,
                (likelihood.shape[0], likelihood.shape[1]),
                sampled,
                angle,
            )
        )

    def _emit(self, path: Path, index: int, belief: NDArray[np.float64]) -> MatchResult:
        """Make the result of a waiting frame; ``belief`` is (P,), probabilities of phases."""
        frame = self._waiting[index]
        back = len(self._waiting) - 1 - index
        sequence, phase, scale, row, column = (int(v) for v in path.states[-1 - back])
        bank, grid = self._bank, self._placements
        similarity = self._similarity_at(frame.sampled, sequence, phase, scale, row, column)
        found = bool(frame.sampled.images.any())
        offsets = self._refine(back, sequence, phase, scale, row, column)
        placement = Placement(0.0, 0.0, 1.0)
        if found:
            placement = grid.placement(
                scale + offsets[2], row + offsets[3], column + offsets[4], frame.angle
            )
        azimuth = self._azimuth(sequence, offsets[0])
        seconds = (frame.stamp_ns - self._origin_ns) / 1e9
        rate = self._clock.rate
        expected = self._near_leg.expected(seconds, rate)
        if expected is None:
            expected = (phase + offsets[1]) / bank.phases
        share, sure = phase_near(belief, expected)
        share = self._near_leg.update(share, azimuth, seconds)
        body = placement.body(frame.box, frame.angle)
        return MatchResult(
            stamp_ns=frame.stamp_ns,
            track_id=frame.track_id,
            body=body,
            placement=placement,
            sequence=sequence,
            phase_index=phase,
            phase=share,
            phase_rate=rate,
            azimuth=azimuth,
            similarity=similarity,
            confidence=sure if found else 0.0,
            shape_prior=warp_template(
                bank.templates[sequence, phase],
                body.scaled(frame.scale),
                bank.fill,
                frame.shape,
            ),
        )

    def _similarity_at(
        self, sampled: Sampled, sequence: int, phase: int, scale: int, row: int, column: int
    ) -> float:
        """Return the similarity of one template at one placement over the known pixels."""
        windows = self._placements.windows
        top, left = row * windows.step, column * windows.step
        part = (scale, slice(top, top + windows.height), slice(left, left + windows.width))
        template = self._templates[sequence * self._bank.phases + phase]
        if sampled.known is not None:
            template = np.minimum(template, sampled.known[part])
        values = sampled.images[part]
        common = int(np.minimum(template, values).sum(dtype=np.int64))
        joint = int(values.sum(dtype=np.int64)) + int(template.sum(dtype=np.int64)) - common
        return common / joint if joint else 0.0

    def _refine(
        self, back: int, sequence: int, phase: int, scale: int, row: int, column: int
    ) -> list[float]:
        """
        Return how far the best state lies beside the given one, in steps of -0.5 to 0.5.

        :returns: for view, phase, scale, row and column: the vertex of the parabola through the
            scores of the state and its two neighbours.
        """
        scores = self._path.scores(back)
        shape = self._placements.shape
        phases = self._bank.phases
        here = (sequence, phase, scale, row, column)

        def score(state: tuple[int, ...]) -> float:
            lane = state[2] * self._kernel.pitch + state[3] * shape[2] + state[4]
            return float(scores[state[0], state[1] % phases, lane])

        result = []
        for axis in range(5):
            if axis == 0:
                sides = self._beside[sequence]
            else:
                sides = (here[axis] - 1, here[axis] + 1)
            if axis >= 2 and not (sides[0] >= 0 and sides[1] < shape[axis - 2]):
                result.append(0.0)
                continue
            low, high = (score((*here[:axis], side, *here[axis + 1 :])) for side in sides)
            middle = score(here)
            bend = 2 * middle - low - high
            vertex = 0.5 * (high - low) / bend if bend > 0 else 0.0
            result.append(min(max(vertex, -0.5), 0.5))
        return result

    def _towards(self, sequence: int, azimuth: float) -> tuple[int, float] | None:
        """Return the view next to a sequence on the side of an azimuth, and its share."""
        own = float(self._bank.azimuth[sequence])
        off = turned(azimuth - own)
        other = self._beside[sequence][1 if off > 0 else 0]
        gap = abs(turned(float(self._bank.azimuth[other]) - own))
        if not 0 < gap <= math.pi / 4:
            return None
        return other, min(abs(off) / gap, 1.0)

    def _azimuth(self, sequence: int, offset: float) -> float:
        """Return the azimuth ``offset`` views beside a sequence."""
        own = float(self._bank.azimuth[sequence])
        other = self._beside[sequence][1 if offset > 0 else 0]
        gap = abs(turned(float(self._bank.azimuth[other]) - own))
        if gap > math.pi / 4:
            return turned(own)
        return turned(own + offset * gap)


@lru_cache(maxsize=4)
def _neighbours(bank: TemplateBank) -> list[tuple[int, int]]:
    """Return each sequence's neighbouring views of its build, clockwise and anticlockwise."""
    result = []
    for sequence, build in enumerate(bank.builds):
        alike = [k for k, name in enumerate(bank.builds) if name == build]
        alike.sort(key=lambda k: float(bank.azimuth[k]))
        place = alike.index(sequence)
        result.append((alike[place - 1], alike[(place + 1) % len(alike)]))
    return result


def _nobody(stamp_ns: int, track_id: int, shape: tuple[int, ...]) -> MatchResult:
    """Return the result of a frame without a box."""
    return MatchResult(
        stamp_ns, track_id, None, None, 0, 0, 0.0, 0.0, 0.0, 0.0, 0.0, np.zeros(shape, np.uint8)
    )
