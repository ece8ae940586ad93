# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One matcher for each slot, and their results put together frame by frame."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.crew import Crew
from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.geometry import check_matched_box
from gait_segmentation.images import check_later
from gait_segmentation.matching.config import MatchingConfig
from gait_segmentation.matching.inputs import check_frame
from gait_segmentation.matching.matcher import SequenceMatcher
from gait_segmentation.matching.sampling import warp_template
from gait_segmentation.results import TRACKED, MatchResult, TrackResult

__all__ = ['PeopleMatcher']


class PeopleMatcher:
    """
    Matches the likelihoods of several people.

    Where somebody who stands nearer to the camera, with lower feet, hides a person, the person's
    likelihood says nothing; that is where the other one's last template stands in the new frame.

    With a lag, empty slots would answer at once and others later; a frame is handed out when
    all have answered.
    """

    def __init__(
        self,
        bank: TemplateBank,
        config: MatchingConfig | None = None,
        *,
        max_people: int = 1,
        threads: int = 1,
    ) -> None:
        """
        Make a matcher for each slot.

        :param bank: the sequences.
        :param max_people: number of slots.
        :param threads: how many work at a time.
        """
        self._bank = bank
        self._config = config or MatchingConfig()
        self._slots = [SequenceMatcher(bank, self._config) for _ in range(max_people)]
        self._last: list[MatchResult | None] = [None] * max_people
        self._crew = Crew(threads)
        # By stamp, of frames that not all slots have a result for: those there are, by slot.
        self._frames: dict[int, dict[int, MatchResult]] = {}
        self._stamp_ns = 0

    @property
    def config(self) -> MatchingConfig:
        """Return the configuration; exchanging it begins all paths anew."""
        return self._config

    @config.setter
    def config(self, config: MatchingConfig) -> None:
        self._config = config
        self._slots = [SequenceMatcher(self._bank, config) for _ in self._slots]
        self._last = [None] * len(self._slots)
        self._frames.clear()

    def reset(self) -> None:
        """Forget all frames, also those whose results have not been handed out."""
        for slot in self._slots:
            slot.reset()
        self._last = [None] * len(self._slots)
        self._frames.clear()
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
            # Before anybody's state is changed, and where others stand is drawn.
            check_frame(track.likelihood, track.stamp_ns, source_size, None, track.angle)
            if track.body is not None:
                check_matched_box(track.body, source_size)
        stamp_ns = tracks[0].stamp_ns
        check_later(stamp_ns, self._stamp_ns)
        size = source_size
        pairs = list(zip(self._slots, tracks, strict=True))
        tasks = [
            partial(_match, slot, track, size, self._known(track, tracks, size))
            for slot, track in pairs
            if track.body
        ]
        found = iter(self._crew.run(tasks))
        results = [
            next(found) if track.body else _match(slot, track, size) for slot, track in pairs
        ]
        self._stamp_ns = stamp_ns
        self._frames[stamp_ns] = {}
        for index, each in enumerate(results):
            self._file(index, each)
        return self._complete()

    def flush(self) -> list[tuple[MatchResult, ...]]:
        """Return the results that the lag still holds back, and let the paths begin anew."""
        for index, slot in enumerate(self._slots):
            self._file(index, slot.flush())
        return self._complete()

    def _known(
        self, track: TrackResult, tracks: Sequence[TrackResult], source_size: tuple[int, int]
    ) -> NDArray[np.uint8] | None:
        """Return where others do not hide a person, None if that is everywhere."""
        known = None
        body = track.body
        for other, last in zip(tracks, self._last, strict=True):
            if last is None or last.placement is None or last.track_id != other.track_id:
                continue
            if other is track or other.state != TRACKED or other.body is None or body is None:
                continue
            if other.body.bottom <= body.bottom or other.body.iou(body) <= 0:
                continue
            shape = (track.likelihood.shape[0], track.likelihood.shape[1])
            where = last.placement.body(other.body, other.angle)
            template = self._bank.templates[last.sequence, last.phase_index]
            cover = warp_template(
                template, where.scaled(shape[1] / source_size[0]), self._bank.fill, shape
            )
            known = np.full(shape, 255, np.uint8) if known is None else known
            known[cover > 127] = 0
        return known

    def _file(self, slot: int, results: list[MatchResult]) -> None:
        if results:
            self._last[slot] = results[-1]
        for result in results:
            if result.stamp_ns in self._frames:
                self._frames[result.stamp_ns][slot] = result

    def _complete(self) -> list[tuple[MatchResult, ...]]:
        # All slots answer in the order of the frames, so these are the first ones.
        done = [stamp for stamp, each in self._frames.items() if len(each) == len(self._slots)]
        complete = [self._frames.pop(stamp) for stamp in done]
        return [tuple(each[slot] for slot in range(len(self._slots))) for each in complete]


def _match(
    slot: SequenceMatcher,
    track: TrackResult,
    source_size: tuple[int, int],
    known: NDArray[np.uint8] | None = None,
) -> list[MatchResult]:
    return slot.update(
        track.likelihood,
        track.body,
        track.stamp_ns,
        track_id=track.track_id,
        source_size=source_size,
        known=known,
        angle=track.angle,
    )
