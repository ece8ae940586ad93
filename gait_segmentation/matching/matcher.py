# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The matching stage: from likelihoods to the path of templates."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import InputError
from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.geometry import Box, Placement, check_matched_box
from gait_segmentation.images import same_proportions
from gait_segmentation.matching.config import MatchingConfig
from gait_segmentation.matching.path import UNIT, PathSearch, State
from gait_segmentation.matching.phase import NearLeg, PhaseFinder, phase_near
from gait_segmentation.matching.placements import PlacementGrid, Sampled, SearchRange
from gait_segmentation.matching.sampling import refined_box, warp_template
from gait_segmentation.matching.similarities import SimilarityMaps, coded_bank
from gait_segmentation.matching.views import Views
from gait_segmentation.results import MatchResult
from gait_segmentation.stamps import check_later, check_stamp


def check_frame(
    likelihood: NDArray[np.uint8],
    stamp_ns: int,
    source_size: tuple[int, int],
    box: Box | None,
    angle: float,
    known: NDArray[np.uint8] | None = None,
) -> float:
    """
    Refuse what cannot be used; the parameters are those of :meth:`SequenceMatcher.update`.

    :returns: the width of the likelihood over that of the source.
    :raises InputError: if a value cannot be used.
    """
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
    check_stamp(stamp_ns)
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
    if box is not None:
        check_matched_box(box, source_size)
    return likelihood.shape[1] / width


@dataclass(frozen=True)
class _Waiting:
    """
    A frame whose result has not been emitted.

    ``seconds`` counts from the beginning of the path.  ``scale`` and ``shape`` are those of the
    likelihood, ``sampled`` is it about the box.
    """

    stamp_ns: int
    seconds: float
    box: Box
    angle: float
    scale: float
    shape: tuple[int, ...]
    sampled: Sampled


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
        self.config = config = config or MatchingConfig()
        self._bank = bank
        self._placements = grid = PlacementGrid(bank.grid, bank.fill, config)
        self._templates, coded = coded_bank(bank, config.levels, grid.windows, config.kernel)
        cost = np.round(UNIT * config.scale_cost * np.abs(np.log(grid.scales))).astype(np.int16)
        self._similarities = SimilarityMaps(coded, grid.windows, cost)
        self._reach = config.scale_reach, config.shift_reach, config.shift_reach
        self._searched = grid.everywhere.about(grid.center, self._reach)
        self._place = grid.center
        self._path = PathSearch(bank, coded.row, config)
        self._views = Views(bank)
        self._phase = PhaseFinder(bank, config)
        self._near_leg = NearLeg()
        self.reset()

    def reset(self) -> None:
        """Forget all frames, also those whose results have not been emitted."""
        self._stamp_ns = 0
        self._track_id = 0
        self._begin()

    def _begin(self) -> None:
        self._path.reset()
        self._waiting: deque[_Waiting] = deque()
        self._phase.reset()
        self._near_leg.reset()

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

        Another ``track_id``, no box, or a pause longer than the window ends the path: the results
        that the lag holds back are emitted and the next frame begins a new path.

        :param likelihood: (h, w) uint8, 255 = surely person, of the source's proportions.
        :param box: tight box of the person in source pixels, not absurdly small, large or far
            away (:func:`~gait_segmentation.geometry.check_matched_box`); None = nobody is tracked.
        :param stamp_ns: the frame's stamp in nanoseconds, later than the last one's.
        :param track_id: who is tracked.
        :param source_size: (width, height) of the source image.
        :param known: (h, w) uint8, 0 where the likelihood says nothing, as where something hides
            the person; None = known everywhere.  What is outside of the image is never known.
        :param angle: tilt of the body's axis in radians, positive with the head to the right.
        :returns: the results that are complete now, oldest first.  With a lag of n frames the
            first n calls of a path return nothing.  Without a box, the last one is empty.
        :raises InputError: if a value cannot be used; the state is then as before.
        """
        scale = check_frame(likelihood, stamp_ns, source_size, box, angle, known)
        check_later(stamp_ns, self._stamp_ns)
        results: list[MatchResult] = []
        pause = (stamp_ns - self._stamp_ns) / 1e9
        if box is None or track_id != self._track_id or pause > self.config.window:
            results = self.flush()
        self._stamp_ns, self._track_id = stamp_ns, track_id
        if box is None:
            return [*results, MatchResult.nobody(stamp_ns, track_id, likelihood.shape)]
        self._take_in(likelihood, known, box, scale, angle)
        if len(self._waiting) > self.config.lag:
            results.append(self._emit(self._path.follow()))
        return results

    def flush(self) -> list[MatchResult]:
        """Return the results that the lag still holds back, and let the path begin anew."""
        results = []
        if self._waiting:
            states = self._path.follow()
            results = [self._emit(states) for _ in range(len(self._waiting))]
        self._begin()
        return results

    def _take_in(
        self,
        likelihood: NDArray[np.uint8],
        known: NDArray[np.uint8] | None,
        box: Box,
        scale: float,
        angle: float,
    ) -> None:
        """Match a frame and take it into the path and the phase."""
        grid, begins = self._placements, self._path.frames == 0
        if begins:
            self._origin_ns = self._stamp_ns
        seconds = (self._stamp_ns - self._origin_ns) / 1e9
        small = box.scaled(scale)
        searched = grid.everywhere if begins else self._about_path()
        sampled = grid.sample(likelihood, known, small, self.config.blur, angle, searched.heights)
        similarity = self._similarities.update(sampled, searched)
        if begins:
            # Not the best template's, so that the order of the rows does not matter.
            best = searched.place(int(similarity[:, : searched.size].max(axis=0).argmax()))
            searched = searched.about(best, self._reach)
            similarity = self._similarities.update(sampled, searched)
        self._searched = searched
        self._path.step(similarity, seconds, searched)
        frame = _Waiting(self._stamp_ns, seconds, box, angle, scale, likelihood.shape, sampled)
        self._waiting.append(frame)
        leader = self._path.leader
        self._place = leader[2:]
        self._newest = placement, azimuth, _ = self._between(leader, 0, angle)
        view = self._bank.builds[leader[0]], azimuth
        body = placement.body(small, angle)
        self._phase.update(likelihood, known, body, view, leader[1], seconds)

    def _about_path(self) -> SearchRange:
        """
        Return the placements to search: those about where the path leads.

        They stay the same as long as the path is well within them.
        """
        last, middle = self._searched, []
        for axis, far in enumerate(self._reach):
            center = last.first[axis] + last.shape[axis] // 2
            kept = abs(self._place[axis] - center) < max(far - 1, 1)
            middle.append(center if kept else self._place[axis])
        return self._placements.everywhere.about((middle[0], middle[1], middle[2]), self._reach)

    def _between(self, state: State, back: int, angle: float) -> tuple[Placement, float, float]:
        """
        Return placement, azimuth and phase of a state of a frame, between those searched.

        :param back: frames since.
        """
        beside = self._views.beside(state[0])
        view, phase, *place = self._path.scores(back).offsets(state, beside, self._bank.phases)
        scale, row, column = (at + off for at, off in zip(state[2:], place, strict=True))
        placement = self._placements.placement(scale, row, column, angle)
        azimuth = self._views.azimuth(state[0], view)
        return placement, azimuth, (state[1] + phase) / self._bank.phases

    def _emit(self, states: NDArray[np.int64]) -> MatchResult:
        """
        Make the result of the frame that waits longest.

        :param states: (N, 5), the path, which ends in the newest frame.
        """
        back = len(self._waiting) - 1
        frame = self._waiting.popleft()
        sequence, phase, scale, row, column = states[-1 - back].tolist()
        state = sequence, phase, scale, row, column
        image, bank, rate = frame.sampled.images[scale], self._bank, self._phase.rate
        found_at = self._between(state, back, frame.angle) if back else self._newest
        placement, azimuth, expected = found_at
        images = frame.sampled.images
        found = cv2.countNonZero(images.reshape(-1, images.shape[2])) > 0
        if not found:
            placement = Placement(0.0, 0.0, 1.0)
        belief = self._phase.belief(back)
        share, sure = phase_near(belief, self._near_leg.expected(frame.seconds, rate, expected))
        body, template = placement.body(frame.box, frame.angle), bank.templates[sequence, phase]
        height, width = frame.shape
        grid = self._placements
        return MatchResult(
            stamp_ns=frame.stamp_ns,
            track_id=self._track_id,
            body=body,
            placement=placement,
            sequence=sequence,
            phase_index=phase,
            phase=self._near_leg.update(share, azimuth, frame.seconds),
            phase_rate=rate,
            azimuth=azimuth,
            similarity=self._similarity(frame.sampled, state),
            confidence=sure if found else 0.0,
            shape_prior=warp_template(
                template, body.scaled(frame.scale), bank.fill, (height, width)
            ),
            box=refined_box(
                image,
                template,
                grid.windows.part(row, column),
                grid.body,
                grid.transform(frame.box, scale, frame.angle),
            ),
        )

    def _similarity(self, sampled: Sampled, state: State) -> float:
        """Return the similarity of one template at one placement over the known pixels."""
        sequence, phase, scale, row, column = state
        part = (scale, *self._placements.windows.part(row, column))
        template = self._templates[sequence, phase]
        if sampled.known is not None:
            template = np.minimum(template, sampled.known[part])
        values = sampled.images[part]
        common = int(np.minimum(template, values).sum(dtype=np.int64))
        union = int(values.sum(dtype=np.int64)) + int(template.sum(dtype=np.int64)) - common
        return common / union if union else 0.0
