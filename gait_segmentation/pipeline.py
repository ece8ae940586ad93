# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The three stages in lockstep: every frame, the same bits on every run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.detector.networks import DetectorConfig
from gait_segmentation.detector.scheduler import DetectorScheduler
from gait_segmentation.gait_model import TemplateBank, default_bank
from gait_segmentation.geometry import Box
from gait_segmentation.heat_maps import heat_map_of
from gait_segmentation.images import check_image
from gait_segmentation.matching import MatchingConfig, PeopleMatcher
from gait_segmentation.people import PeopleConfig
from gait_segmentation.results import Feedback, MatchResult, SegmentationResult, TrackResult
from gait_segmentation.segmentation import PeopleSegmenter, SegmentationConfig
from gait_segmentation.stamps import HeldFrames, Order, Stamps, check_stamp
from gait_segmentation.starting import StartingConfig
from gait_segmentation.tracking import PeopleTracker, TrackingConfig


@dataclass(frozen=True)
class PipelineConfig:
    """The configurations of the three stages and of what they share."""

    tracking: TrackingConfig = field(default_factory=TrackingConfig)
    matching: MatchingConfig = field(default_factory=MatchingConfig)
    segmentation: SegmentationConfig = field(default_factory=SegmentationConfig)
    people: PeopleConfig = field(default_factory=PeopleConfig)
    starting: StartingConfig = field(default_factory=StartingConfig)
    detector: DetectorConfig = field(default_factory=DetectorConfig)


@dataclass(frozen=True)
class PersonResult:
    """All that is known of one slot in one frame."""

    track: TrackResult
    match: MatchResult
    segmentation: SegmentationResult


@dataclass(frozen=True)
class FrameResult:
    """
    All that is known of one frame.

    ``people`` has one result a slot.  ``mask`` is (H, W) uint8 0/255, the union of their masks,
    and ``labels`` (H, W) uint8, 0 or slot + 1.  ``timings_ms`` holds what the stages took:
    ``tracking`` (with learning), ``matching``, ``segmentation`` and ``total``.  With a lag they
    are those of the call that emitted the frame.
    """

    stamp_ns: int
    people: tuple[PersonResult, ...]
    mask: NDArray[np.uint8]
    labels: NDArray[np.uint8]
    timings_ms: dict[str, float]

    @classmethod
    def empty(
        cls, track: TrackResult, shape: tuple[int, int], slots: int, reason: str
    ) -> FrameResult:
        """
        Return the empty result of a frame.

        :param track: the empty result of the tracker, of every slot.
        :param shape: (H, W) of the image.
        :param reason: why there is no mask.
        """
        stamp_ns, mask = track.stamp_ns, np.zeros(shape, np.uint8)
        person = PersonResult(
            track,
            MatchResult.empty(stamp_ns, 0, track.likelihood.shape),
            SegmentationResult(stamp_ns, 0, mask, reason),
        )
        return cls(stamp_ns, (person,) * slots, mask, mask, {})


class Pipeline:
    """
    Tracker, matcher and segmenter, frame by frame.

    With ``matching.lag`` at 0 every call of :meth:`update` returns the result of its frame; with
    a lag of n frames it returns that of n frames before, and :meth:`flush` the rest.
    """

    def __init__(
        self,
        config: PipelineConfig | None = None,
        bank: TemplateBank | None = None,
        clock: Callable[[], float] = float,
        *,
        scheduler: DetectorScheduler | None = None,
    ) -> None:
        """
        Make a pipeline without tracks.

        :param bank: the templates; the standard bank if None.
        :param clock: seconds for ``timings_ms``, e.g. ``time.perf_counter``; without it all are
            zero, as ``float()`` is.
        :param scheduler: what has networks look; if None that of the configuration, in lockstep.
        """
        self._clock = clock
        self.config = config = config or PipelineConfig()
        self.bank = bank if bank is not None else default_bank()
        slots = config.people.max_people
        self.tracker = PeopleTracker(
            self.bank,
            config.tracking,
            max_people=slots,
            starting=config.starting,
            scheduler=scheduler or DetectorScheduler(config.detector),
        )
        self.matcher = PeopleMatcher(self.bank, config.matching, max_people=slots)
        self.segmenter = PeopleSegmenter(config.segmentation, max_people=slots)
        self._held: HeldFrames[tuple[NDArray[np.uint8], list[TrackResult]]] = HeldFrames()
        self._feedback: list[tuple[list[Feedback], dict[str, float]]] = []
        self._stamps = Stamps()
        self.stale = 0
        """Frames dropped since their stamps were not later than those before."""

    def reset(self, *, waiting: bool = True) -> None:
        """
        Drop all tracks and results that are held back; any stamp may follow.

        :param waiting: whether to drop the boxes and maps that wait for the next frame, too.
        """
        self.tracker.reset(waiting=waiting)
        self.matcher.reset()
        self.segmenter.reset()
        self._held = HeldFrames()
        self._feedback.clear()
        self._stamps = Stamps()

    def initialize(self, box: Box) -> None:
        """Start a new track at the next frame from a tight box in source pixels."""
        self.tracker.initialize(box)

    def add_heat_map(self, heat_map: NDArray[Any], stamp_ns: int) -> None:
        """Add a heat map, see :meth:`PeopleTracker.add_heat_map`; InputError if it is none."""
        self.tracker.add_heat_map(heat_map, stamp_ns)

    def update(
        self,
        image: NDArray[np.uint8],
        stamp_ns: int,
        heat_map: NDArray[Any] | None = None,
        *,
        learn: bool = True,
    ) -> list[FrameResult]:
        """
        Take in a frame.

        Arguments are not written to, nor read again after the call; what is returned
        may be written to.

        :param image: (H, W, 3) uint8 BGR.
        :param stamp_ns: its stamp.  If it is more than a second earlier than the one before,
            everything is reset; otherwise one that is not later is dropped and counted.
        :param heat_map: a heat map of people in this frame: evidence beside the
            tracker's own, see :meth:`add_heat_map`.
        :param learn: whether to learn from the results at once.  Who has to hand them on first
            calls :meth:`apply_feedback` after that; it is done before the next frame otherwise.
        :returns: the results that are complete now.
        :raises InputError: if the frame cannot be used; the state is then as before.
        """
        self.apply_feedback()
        started = self._clock()
        check_image(image)
        check_stamp(stamp_ns)
        order = self._stamps.order(stamp_ns)
        if order is Order.STALE:
            self.stale += 1
            return []
        if order is Order.RESET:
            # Not for a frame that cannot be used.
            self.tracker.check(image)
            if heat_map is not None:
                heat_map_of(heat_map)
            self.reset(waiting=False)
        tracks = self.tracker.update(image, stamp_ns, heat_map)
        self._stamps.newest_ns = stamp_ns
        tracked = self._clock()
        matches = self.matcher.update(tracks, source_size=(image.shape[1], image.shape[0]))
        matched = self._clock()
        # Until then the caller may have filled its buffer again.
        kept = image.copy() if self.config.matching.lag > 0 else image
        self._held.hold(stamp_ns, (kept, tracks))
        times = {'tracking': tracked - started, 'matching': matched - tracked}
        results = [self._finish(frame, times) for frame in matches]
        if learn:
            self.apply_feedback()
        return results

    def flush(self) -> list[FrameResult]:
        """Return the results that the lag still holds back, and end the paths."""
        started = self._clock()
        matches = self.matcher.flush()
        times = {'tracking': 0.0, 'matching': self._clock() - started}
        results = [self._finish(frame, times) for frame in matches]
        self.apply_feedback()
        return results

    def apply_feedback(self) -> None:
        """Let the tracker learn from the newest masks; its time is added to ``timings_ms``."""
        waiting, self._feedback = self._feedback, []
        for feedback, timings_ms in waiting:
            started = self._clock()
            self.tracker.learn(feedback)
            passed_ms = 1e3 * (self._clock() - started)
            timings_ms['tracking'] += passed_ms
            timings_ms['total'] += passed_ms

    def _finish(self, matches: Sequence[MatchResult], times: dict[str, float]) -> FrameResult:
        image, tracks = self._held.take(matches[0].stamp_ns)
        started = self._clock()
        likelihoods = [track.likelihood for track in tracks]
        masks = self.segmenter.update(image, likelihoods, matches)
        seconds = {**times, 'segmentation': self._clock() - started}
        seconds['total'] = sum(seconds.values())
        timings_ms = {name: 1e3 * value for name, value in seconds.items()}
        people = list(zip(tracks, matches, masks.people, strict=True))
        # Also that the lost were not found.
        feedback = [
            Feedback(match.stamp_ns, match.track_id, found.mask, match.body, match.shape_prior)
            for track, match, found in people
            if track.track_id
        ]
        self._feedback.append((feedback, timings_ms))
        return FrameResult(
            tracks[0].stamp_ns,
            tuple(PersonResult(*each) for each in people),
            masks.mask,
            masks.labels,
            timings_ms,
        )
