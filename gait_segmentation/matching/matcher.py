# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The matching stage: from likelihoods to the path of templates."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import InputError
from gait_segmentation.gait_model.bank import TemplateBank, quantize
from gait_segmentation.geometry import Box, Placement, check_matched_box, template_to_image
from gait_segmentation.images import check_map, same_proportions
from gait_segmentation.matching.common_areas import (
    UNIT,
    CommonAreas,
    DirectAccessTableKernel,
    SimilarityMaps,
)
from gait_segmentation.matching.config import MatchingConfig
from gait_segmentation.matching.events import EventKernel
from gait_segmentation.matching.path import PathSearch, State
from gait_segmentation.matching.phase import PhaseFilter
from gait_segmentation.matching.placements import (
    PlacementGrid,
    Sampled,
    SearchRange,
    WindowGrid,
    likely_box,
    warp_template,
)
from gait_segmentation.results import TRACKED, MatchResult, TrackResult
from gait_segmentation.stamps import check_later

KERNELS: dict[str, type[CommonAreas]] = {
    'events': EventKernel,
    'direct_access_table': DirectAccessTableKernel,
}
"""Those there are to choose from (``matching.kernel``); they give the same bits."""


@lru_cache(maxsize=2)
def coded_bank(
    bank: TemplateBank, levels: int, windows: WindowGrid, kernel: str
) -> tuple[NDArray[np.uint8], CommonAreas]:
    """
    Code the templates of a bank; those of the last banks are kept, and not written to.

    :param levels: parameter of the matching stage, as is ``kernel``.
    :param windows: where templates are laid.
    :returns: the templates as they are compared, (V, P, H, W) uint8, and the kernel.
    """
    templates = quantize(bank.templates, levels)
    if np.array_equal(templates, bank.templates):
        templates = bank.templates
    return templates, KERNELS[kernel](templates.reshape(-1, *bank.grid), windows)


@dataclass(frozen=True)
class _Waiting:
    """A frame without a result; scale and shape are the likelihood's."""

    stamp_ns: int
    box: Box
    angle: float
    scale: float
    shape: tuple[int, ...]
    sampled: Sampled


class SequenceMatcher:
    """Matches one person's likelihoods to a bank (Wang, Yagi, Makihara, ACCV 2009, section 3)."""

    def __init__(self, bank: TemplateBank, config: MatchingConfig | None = None) -> None:
        """Prepare the templates of a bank; the parameters are the defaults if None."""
        self.config = config = config or MatchingConfig()
        self._bank = bank
        self._placements = grid = PlacementGrid(bank.grid, bank.fill, config)
        self._templates, coded = coded_bank(bank, config.levels, grid.windows, config.kernel)
        cost = np.round(UNIT * config.scale_cost * np.abs(np.log(grid.scales))).astype(np.int16)
        self._similarities = SimilarityMaps(coded, grid.windows, cost)
        self._reach = config.scale_reach, config.shift_reach, config.shift_reach
        self._row = coded.row
        self._stamp_ns = 0
        self._track_id = 0
        self._start_path()

    def _start_path(self) -> None:
        self._path = PathSearch(self._bank, self._row, self.config)
        self._waiting: deque[_Waiting] = deque()
        self._phase = PhaseFilter(self._bank, self.config)

    def add_frame(
        self,
        track: TrackResult,
        source_size: tuple[int, int],
        known: NDArray[np.uint8] | None = None,
    ) -> list[MatchResult]:
        """
        Take in a frame, which :class:`PeopleMatcher` has checked.

        Another ``track_id``, no body, or a pause longer than the window ends the path: the results
        that the lag holds back are emitted and the next frame begins a new path.

        :param track: what the tracker says of the person, in a frame later than the last one.
        :param source_size: (width, height) of the source image.
        :param known: (h, w) uint8, 0 where the likelihood says nothing, as where something hides
            the person; None = known everywhere.  What is outside of the image is never known.
        :returns: the results that are complete now, oldest first.  With a lag of n frames the
            first n calls of a path return nothing.  Without a body, the last one is empty.
        """
        likelihood, box, stamp_ns = track.likelihood, track.body, track.stamp_ns
        results: list[MatchResult] = []
        pause = (stamp_ns - self._stamp_ns) / 1e9
        if box is None or track.track_id != self._track_id or pause > self.config.window:
            results = self.flush()
        self._stamp_ns, self._track_id = stamp_ns, track.track_id
        if box is None:
            return [*results, MatchResult.empty(stamp_ns, track.track_id, likelihood.shape)]
        grid, begins = self._placements, not self._path.frames
        if begins:
            self._origin_ns = stamp_ns
        seconds = (stamp_ns - self._origin_ns) / 1e9
        scale, angle = likelihood.shape[1] / source_size[0], track.angle
        small = box.scaled(scale)
        searched = grid.everywhere if begins else self._about_path()
        sampled = grid.sample(
            likelihood, known, small, self.config.blur, angle, searched.slices[0]
        )
        similarity = self._similarities.compare(sampled, searched)
        if begins:
            # Not the best template's, so that the order of the rows does not matter.
            best = searched.place(int(similarity[:, : searched.size].max(axis=0).argmax()))
            searched = searched.about(best, self._reach)
            similarity = self._similarities.compare(sampled, searched)
        self._path.step(similarity, seconds, searched)
        frame = _Waiting(stamp_ns, box, angle, scale, likelihood.shape, sampled)
        self._waiting.append(frame)
        leader = self._path.leader
        self._newest = placement, azimuth, _ = self._between(leader, 0, angle)
        view = self._bank.builds[leader[0]], azimuth
        body = placement.body(small, angle)
        self._phase.add_frame(likelihood, known, body, view, leader[1], seconds)
        if len(self._waiting) > self.config.lag:
            results.append(self._emit(self._path.follow()))
        return results

    def flush(self) -> list[MatchResult]:
        """Return the results that the lag still holds back, and end the path."""
        results = []
        if self._waiting:
            states = self._path.follow()
            results = [self._emit(states) for _ in range(len(self._waiting))]
        if self._path.frames:
            self._start_path()
        return results

    def _about_path(self) -> SearchRange:
        """Return the placements about the path's: the same ones while it is well within them."""
        last, place = self._path.frames[-1].searched, self._path.leader[2:]
        centers = [first + count // 2 for first, count in zip(last.first, last.shape, strict=True)]
        middle = [
            center if abs(at - center) < max(far - 1, 1) else at
            for at, center, far in zip(place, centers, self._reach, strict=True)
        ]
        if middle == centers:
            return last
        return self._placements.everywhere.about((middle[0], middle[1], middle[2]), self._reach)

    def _between(self, state: State, back: int, angle: float) -> tuple[Placement, float, float]:
        """Return placement, azimuth and phase, between those searched, ``back`` frames ago."""
        azimuth, offsets = self._path.beside(state, back)
        phase, scale, row, column = (at + by for at, by in zip(state[1:], offsets, strict=True))
        placement = self._placements.placement(scale, row, column, angle)
        return placement, azimuth, phase / self._bank.phases

    def _emit(self, states: NDArray[np.int64]) -> MatchResult:
        """Make the result of the frame that waits longest, by a path that ends in the newest."""
        back = len(self._waiting) - 1
        frame = self._waiting.popleft()
        state: State = tuple(states[-1 - back].tolist())
        sequence, phase, scale, row, column = state
        images, known = frame.sampled.images, frame.sampled.known
        bank, grid = self._bank, self._placements
        placement, azimuth, expected = (
            self._between(state, back, frame.angle) if back else self._newest
        )
        found = cv2.countNonZero(images.reshape(-1, images.shape[2])) > 0
        if not found:
            placement = Placement(0.0, 0.0, 1.0)
        share, sure = self._phase.phase(back, expected, azimuth)
        body, template = placement.body(frame.box, frame.angle), bank.templates[sequence, phase]
        height, width = frame.shape
        part = grid.windows.part(row, column)
        # Over the known pixels.
        values, compared = images[scale][part], self._templates[sequence, phase]
        if known is not None:
            compared = np.minimum(compared, known[scale][part])
        common = int(np.minimum(compared, values).sum(dtype=np.int64))
        union = int(values.sum(dtype=np.int64)) + int(compared.sum(dtype=np.int64)) - common
        searched = Placement(0.0, 0.0, float(grid.scales[scale])).body(frame.box, frame.angle)
        across = placement.scale * frame.box.width
        placed = Box.from_center(body.center_x, body.center_y, across, body.height)
        box: Box | None = placed
        if self.config.use_likely_box:
            to_source = template_to_image(searched, *grid.windows.image_shape, grid.body)
            box = likely_box(images[scale], template, part, grid.body, to_source)
        return MatchResult(
            stamp_ns=frame.stamp_ns,
            track_id=self._track_id,
            body=body,
            placement=placement,
            sequence=sequence,
            phase_index=phase,
            phase=share,
            phase_rate=self._phase.rate,
            azimuth=azimuth,
            similarity=common / union if union else 0.0,
            confidence=sure if found else 0.0,
            shape_prior=warp_template(
                template, body.scaled(frame.scale), bank.fill, (height, width)
            ),
            placed=placed,
            box=box,
        )


class PeopleMatcher:
    """
    Matches the likelihoods of several people.

    Where a person who is nearer to the camera, with lower feet, occludes another, the likelihood
    of the other is unknown; that is where the last template of the occluder lies in the new frame.

    With a lag, empty slots would answer at once and others later; a frame is handed out when
    all have answered.
    """

    def __init__(
        self, bank: TemplateBank, config: MatchingConfig | None = None, *, max_people: int = 1
    ) -> None:
        """Make a matcher for each slot."""
        self._bank = bank
        self._count = max_people
        self.config = config or MatchingConfig()

    @property
    def config(self) -> MatchingConfig:
        """Return the configuration; exchanging it drops all paths."""
        return self._config

    @config.setter
    def config(self, config: MatchingConfig) -> None:
        self._config = config
        self.reset()

    def reset(self) -> None:
        """Drop all paths, also the results that are held back."""
        self._slots = [SequenceMatcher(self._bank, self._config) for _ in range(self._count)]
        self._last: list[MatchResult | None] = [None] * self._count
        # Each slot answers every frame once, in the order of the frames.
        self._answers: list[deque[MatchResult]] = [deque() for _ in self._slots]
        self._stamp_ns = 0

    def update(
        self, tracks: Sequence[TrackResult], *, source_size: tuple[int, int]
    ) -> list[tuple[MatchResult, ...]]:
        """
        Take in a frame.

        :param tracks: what the tracker says of each slot, all of one frame that is later than the
            last one.
        :param source_size: (width, height) of the source image.
        :returns: the frames that are complete now, oldest first; of each, one result a slot.
        :raises InputError: if a value cannot be used; the frame is then skipped in all slots.
        """
        for track in tracks:
            # Before the state of any slot is changed, and occluders are drawn.
            _check(track, source_size)
        check_later(tracks[0].stamp_ns, self._stamp_ns)
        self._stamp_ns = tracks[0].stamp_ns
        try:
            found = [
                slot.add_frame(track, source_size, self._unoccluded(track, tracks, source_size))
                for slot, track in zip(self._slots, tracks, strict=True)
            ]
        except Exception:
            # Who has answered would be ahead of the others.
            self.reset()
            raise
        return self._complete(found)

    def flush(self) -> list[tuple[MatchResult, ...]]:
        """Return the results that the lag still holds back, and end the paths."""
        return self._complete([slot.flush() for slot in self._slots])

    def _unoccluded(
        self, track: TrackResult, tracks: Sequence[TrackResult], source_size: tuple[int, int]
    ) -> NDArray[np.uint8] | None:
        """Return where others do not occlude a person, None if that is everywhere."""
        known, body = None, track.body
        for other, last in zip(tracks, self._last, strict=True):
            if last is None or last.placement is None or last.track_id != other.track_id:
                continue
            if other is track or other.state != TRACKED or other.body is None or body is None:
                continue
            if other.body.bottom <= body.bottom or other.body.iou(body) <= 0:
                continue
            height, width = track.likelihood.shape
            where = last.placement.body(other.body, other.angle).scaled(width / source_size[0])
            template = self._bank.templates[last.sequence, last.phase_index]
            occluder = warp_template(template, where, self._bank.fill, (height, width))
            known = np.full((height, width), 255, np.uint8) if known is None else known
            known[occluder > 127] = 0
        return known

    def _complete(self, found: Sequence[list[MatchResult]]) -> list[tuple[MatchResult, ...]]:
        """Take in the results of each slot, and return the frames that are complete."""
        for index, results in enumerate(found):
            self._answers[index].extend(results)
            if results:
                self._last[index] = results[-1]
        complete = min(map(len, self._answers))
        return [tuple(each.popleft() for each in self._answers) for _ in range(complete)]


def _check(track: TrackResult, source_size: tuple[int, int]) -> None:
    """Refuse a track that cannot be matched."""
    likelihood, (width, height) = track.likelihood, source_size
    check_map(likelihood, 'likelihood')
    if not math.isfinite(track.angle):
        raise InputError(f'angle must be a finite number of radians, got {track.angle}')
    if width < 1 or height < 1:
        raise InputError(f'source size must be positive, got {width} x {height}')
    if likelihood.size == 0 or not same_proportions(likelihood.shape, (height, width)):
        raise InputError(
            f'likelihood of {likelihood.shape[1]} x {likelihood.shape[0]} pixels does not '
            f'have the proportions of the source of {width} x {height}'
        )
    if track.body is not None:
        check_matched_box(track.body, source_size)
