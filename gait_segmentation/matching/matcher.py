# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The matching stage: from likelihoods to the path of templates."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import InputError
from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.gait_model.builder import quantize
from gait_segmentation.geometry import Box, Placement
from gait_segmentation.matching.box_motion import BoxMotion
from gait_segmentation.matching.builds import BuildChoice, BuildKernels
from gait_segmentation.matching.confidence import confidence, phase_evidence
from gait_segmentation.matching.config import MatchingConfig
from gait_segmentation.matching.path import Areas, Path, PathSearch
from gait_segmentation.matching.placements import PlacementGrid, Sampled
from gait_segmentation.matching.shape_prior import warp_template
from gait_segmentation.matching.transitions import turned
from gait_segmentation.results import MatchResult

__all__ = ['SequenceMatcher']

_STAND = 0.1
"""A phase that falls back by less, in strides, stands still instead."""


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
    evidence: float


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
        templates = quantize(bank.templates, self.config.levels)
        templates = templates.reshape(-1, *bank.grid)
        self._templates = templates
        self._placements = PlacementGrid(bank.grid, bank.fill, self.config)
        self._builds = BuildChoice(bank, self.config)
        self._kernel = BuildKernels(
            templates.reshape(bank.templates.shape),
            self._builds.of_sequence,
            self._placements.windows,
        )
        self._common = self._kernel.new_rows(len(self._placements.scales))
        area = templates.sum(axis=(1, 2), dtype=np.int32)
        self._path = PathSearch(
            bank,
            area,
            self._kernel.row.reshape(-1),
            self._placements.shape,
            self.config.scale_cost * np.abs(np.log(self._placements.scales)),
            self._kernel.pitch,
            self.config,
        )
        self._visible: NDArray[np.int32] | None = None
        self._motion = BoxMotion()
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
        self._phase: float | None = None

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
        :param box: tight box of the person in source pixels; None = nobody is tracked.
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
            results.append(self._emit(self._path.follow(), 0))
            self._waiting.popleft()
        return results

    def flush(self) -> list[MatchResult]:
        """Return the results that the lag still holds back, and let the path begin anew."""
        results = []
        if self._waiting:
            path = self._path.follow()
            results = [self._emit(path, index) for index in range(len(self._waiting))]
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
        scale = likelihood.shape[1] / width
        if abs(likelihood.shape[0] - scale * height) > 1 + scale:
            raise InputError(
                f'likelihood of {likelihood.shape[1]} x {likelihood.shape[0]} pixels does not '
                f'have the proportions of the source of {width} x {height}'
            )
        return scale

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
            if self._visible is None:
                self._visible = self._kernel.new_rows(scales)
            visible = self._visible
            self._kernel.common_rows(sampled.known, active, visible)
        jump = self._motion.update(box, seconds, grid.shift, grid.log_step)
        self._path.step(
            Areas(common, window.reshape(-1), visible),
            seconds,
            jump,
            active[self._builds.of_sequence],
        )
        leading = self._path.leading
        best = divmod(int(leading.argmax()), leading.shape[1])
        self._waiting.append(
            _Frame(
                self._stamp_ns,
                self._track_id,
                box,
                scale,
                (likelihood.shape[0], likelihood.shape[1]),
                sampled,
                angle,
                phase_evidence(leading, *best),
            )
        )

    def _emit(self, path: Path, index: int) -> MatchResult:
        """Make the result of a waiting frame."""
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
        share = ((phase + offsets[1]) / bank.phases) % 1.0
        if math.cos(azimuth) < -1e-9:
            share = (share + 0.5) % 1.0
        if found:
            share = self._forward(share)
        body = placement.body(frame.box, frame.angle)
        return MatchResult(
            stamp_ns=frame.stamp_ns,
            track_id=frame.track_id,
            body=body,
            placement=placement,
            sequence=sequence,
            phase_index=phase,
            phase=share,
            phase_rate=path.rate,
            azimuth=azimuth,
            similarity=similarity,
            confidence=confidence(frame.evidence) if found else 0.0,
            shape_prior=warp_template(
                bank.templates[sequence, phase],
                body.scaled(frame.scale),
                bank.fill,
                frame.shape,
            ),
        )

    def _forward(self, phase: float) -> float:
        """Return a phase that is not a little behind the last one: nobody walks backwards."""
        if self._phase is not None and 0 < (self._phase - phase) % 1.0 < _STAND:
            phase = self._phase
        self._phase = phase
        return phase

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
                sides = self._beside(sequence)
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

    def _beside(self, sequence: int) -> tuple[int, int]:
        """Return the neighbouring views of the same build, clockwise and anticlockwise."""
        alike = [
            k for k, name in enumerate(self._bank.builds) if name == self._bank.builds[sequence]
        ]
        alike.sort(key=lambda k: float(self._bank.azimuth[k]))
        place = alike.index(sequence)
        return alike[place - 1], alike[(place + 1) % len(alike)]

    def _azimuth(self, sequence: int, offset: float) -> float:
        """Return the azimuth ``offset`` views beside a sequence."""
        own = float(self._bank.azimuth[sequence])
        other = self._beside(sequence)[1 if offset > 0 else 0]
        gap = abs(turned(float(self._bank.azimuth[other]) - own))
        if gap > math.pi / 4:
            return turned(own)
        return turned(own + offset * gap)


def _nobody(stamp_ns: int, track_id: int, shape: tuple[int, ...]) -> MatchResult:
    """Return the result of a frame without a box."""
    return MatchResult(
        stamp_ns, track_id, None, None, 0, 0, 0.0, 0.0, 0.0, 0.0, 0.0, np.zeros(shape, np.uint8)
    )
