# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The three stages in lockstep: every frame, the same bits on every run."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import InputError
from gait_segmentation.gait_model import TemplateBank, default_bank
from gait_segmentation.geometry import Box
from gait_segmentation.matching import MatchingConfig, SequenceMatcher
from gait_segmentation.results import Feedback, MatchResult, SegmentationResult, TrackResult
from gait_segmentation.segmentation import SegmentationConfig, Segmenter
from gait_segmentation.tracking import PersonTracker, TrackingConfig

__all__ = ['PersonResult', 'Pipeline', 'PipelineConfig']


@dataclass(frozen=True)
class PipelineConfig:
    """The configurations of the three stages."""

    tracking: TrackingConfig = field(default_factory=TrackingConfig)
    matching: MatchingConfig = field(default_factory=MatchingConfig)
    segmentation: SegmentationConfig = field(default_factory=SegmentationConfig)


@dataclass(frozen=True)
class PersonResult:
    """
    All that is known of one person in one frame.

    ``timings_ms`` holds what the stages took: ``tracking`` (with learning), ``matching``,
    ``segmentation`` and ``total``.  With a lag they are those of the call that emitted the frame.
    """

    track: TrackResult
    match: MatchResult
    segmentation: SegmentationResult
    timings_ms: dict[str, float]

    @property
    def stamp_ns(self) -> int:
        """Return the stamp of the frame."""
        return self.segmentation.stamp_ns


def _no_clock() -> float:
    return 0.0


class Pipeline:
    """
    Tracker, matcher and segmenter on one person, frame by frame.

    With ``matching.lag`` at 0 every call of :meth:`update` returns the result of its frame; with
    a lag of n frames it returns that of n frames before, and :meth:`flush` the rest.
    """

    def __init__(
        self,
        config: PipelineConfig | None = None,
        bank: TemplateBank | None = None,
        clock: Callable[[], float] = _no_clock,
    ) -> None:
        """
        Make a pipeline that tracks nobody.

        :param bank: the templates; the standard bank if None.
        :param clock: seconds for ``timings_ms``, e.g. ``time.perf_counter``; without it all are
            zero.
        """
        self._clock = clock
        self.config = config or PipelineConfig()
        self.bank = bank if bank is not None else default_bank()
        self.tracker = PersonTracker(self.bank, self.config.tracking)
        self.matcher = SequenceMatcher(self.bank, self.config.matching)
        self.segmenter = Segmenter(self.config.segmentation)
        self._waiting: deque[tuple[NDArray[np.uint8], TrackResult]] = deque()
        self._stamp_ns = 0

    def reset(self) -> None:
        """Forget everybody."""
        self.tracker.reset()
        self.matcher.reset()
        self.segmenter.reset()
        self._waiting.clear()
        self._stamp_ns = 0

    def initialize(self, box: Box) -> None:
        """Start a new track at the next frame from a tight box in source pixels."""
        self.tracker.initialize(box)

    def update(
        self,
        image: NDArray[np.uint8],
        stamp_ns: int,
        likelihood: NDArray[np.uint8] | None = None,
    ) -> list[PersonResult]:
        """
        Take in a frame.

        :param image: (H, W, 3) uint8 BGR.
        :param stamp_ns: its stamp; one that goes backwards resets everything.
        :param likelihood: a likelihood image to use in place of the tracker's, (H, W) uint8 or
            smaller with the same proportions.
        :returns: the results that are complete now.
        :raises InputError: if the frame cannot be used; the state is then as before.
        """
        started = self._clock()
        if stamp_ns < self._stamp_ns:
            self.matcher.reset()
            self.segmenter.reset()
            self._waiting.clear()
        track = self.tracker.update(image, stamp_ns)
        self._stamp_ns = stamp_ns
        if likelihood is not None:
            track = _replaced(track, likelihood)
        tracked = self._clock()
        matches = self.matcher.update(
            track.likelihood,
            track.box,
            stamp_ns,
            track_id=track.track_id,
            source_size=(image.shape[1], image.shape[0]),
            angle=track.angle,
        )
        matched = self._clock()
        self._waiting.append((image, track))
        times = {'tracking': tracked - started, 'matching': matched - tracked}
        return [self._finish(match, times) for match in matches]

    def flush(self) -> list[PersonResult]:
        """Return the results that the lag still holds back, and let the window begin anew."""
        started = self._clock()
        matches = self.matcher.flush()
        times = {'tracking': 0.0, 'matching': self._clock() - started}
        return [self._finish(match, times) for match in matches]

    def _finish(self, match: MatchResult, times: dict[str, float]) -> PersonResult:
        image, track = self._waiting.popleft()
        while track.stamp_ns != match.stamp_ns:
            image, track = self._waiting.popleft()
        started = self._clock()
        result = self.segmenter.update(image, track.likelihood, match)
        segmented = self._clock()
        if track.box is not None:
            self.tracker.learn(
                Feedback(
                    match.stamp_ns, match.track_id, result.mask, match.body, match.shape_prior
                )
            )
        learnt = self._clock()
        seconds = {
            'tracking': times['tracking'] + learnt - segmented,
            'matching': times['matching'],
            'segmentation': segmented - started,
        }
        seconds['total'] = sum(seconds.values())
        milliseconds = {name: 1e3 * value for name, value in seconds.items()}
        return PersonResult(track, match, result, milliseconds)


def _replaced(track: TrackResult, likelihood: NDArray[np.uint8]) -> TrackResult:
    if likelihood.ndim != 2 or likelihood.dtype != np.uint8:
        raise InputError(
            f'likelihood must be (height, width) uint8, got {likelihood.shape} {likelihood.dtype}'
        )
    return replace(track, likelihood=likelihood)
