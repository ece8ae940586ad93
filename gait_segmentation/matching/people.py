# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One matcher for each slot, and their results put together frame by frame."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.matching.config import MatchingConfig
from gait_segmentation.matching.matcher import SequenceMatcher, check_frame
from gait_segmentation.matching.sampling import warp_template
from gait_segmentation.people import Crew
from gait_segmentation.results import TRACKED, MatchResult, TrackResult
from gait_segmentation.stamps import check_later


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
        self._crew = Crew(threads)
        self._count = max_people
        self.config = config or MatchingConfig()

    @property
    def config(self) -> MatchingConfig:
        """Return the configuration; exchanging it begins all paths anew."""
        return self._config

    @config.setter
    def config(self, config: MatchingConfig) -> None:
        self._config = config
        self._slots = [SequenceMatcher(self._bank, config) for _ in range(self._count)]
        self.reset()

    def reset(self) -> None:
        """Forget all frames, also those whose results have not been handed out."""
        for slot in self._slots:
            slot.reset()
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
            # Before anybody's state is changed, and where others stand is drawn.
            check_frame(track.likelihood, track.stamp_ns, source_size, track.body, track.angle)
        check_later(tracks[0].stamp_ns, self._stamp_ns)
        self._stamp_ns = tracks[0].stamp_ns
        calls = [
            partial(
                slot.update,
                track.likelihood,
                track.body,
                track.stamp_ns,
                track_id=track.track_id,
                source_size=source_size,
                known=self._known(track, tracks, source_size),
                angle=track.angle,
            )
            for slot, track in zip(self._slots, tracks, strict=True)
        ]
        # Empty slots are not worth a thread.
        asked = [call for call, track in zip(calls, tracks, strict=True) if track.body]
        try:
            found = iter(self._crew.run(asked))
            pairs = zip(calls, tracks, strict=True)
            return self._filed([next(found) if track.body else call() for call, track in pairs])
        except Exception:
            # Who has answered would be ahead of the others.
            self.reset()
            raise

    def flush(self) -> list[tuple[MatchResult, ...]]:
        """Return the results that the lag still holds back, and let the paths begin anew."""
        return self._filed([slot.flush() for slot in self._slots])

    def _known(
        self, track: TrackResult, tracks: Sequence[TrackResult], source_size: tuple[int, int]
    ) -> NDArray[np.uint8] | None:
        """Return where others do not hide a person, None if that is everywhere."""
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
            cover = warp_template(template, where, self._bank.fill, (height, width))
            known = np.full((height, width), 255, np.uint8) if known is None else known
            known[cover > 127] = 0
        return known

    def _filed(self, found: Sequence[list[MatchResult]]) -> list[tuple[MatchResult, ...]]:
        """Take in the results of each slot, and return the frames that are complete."""
        for index, results in enumerate(found):
            self._answers[index].extend(results)
            if results:
                self._last[index] = results[-1]
        complete = min(map(len, self._answers))
        return [tuple(each.popleft() for each in self._answers) for _ in range(complete)]
