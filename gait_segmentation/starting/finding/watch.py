# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Watching one candidate until the evidence that it walks is enough."""

from __future__ import annotations

import math
from collections import deque

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.geometry import BodyFrame, Box
from gait_segmentation.matching import MatchingConfig, SequenceMatcher
from gait_segmentation.starting.config import StartingConfig
from gait_segmentation.starting.finding.candidates import Candidate
from gait_segmentation.starting.finding.gait import Shape, measures_of, person_box
from gait_segmentation.starting.finding.seat import seat
from gait_segmentation.starting.finding.walking import LEAST_SHAPES, log_odds

__all__ = ['Watch', 'light_bank']

_PERIOD_S = 0.06
"""Time between two frames in which a candidate is matched."""

_WINDOW_S = 0.35
"""Time over which the gait is measured."""

_LATE_S = 2 * _PERIOD_S
"""Time for which one match speaks at most."""

_ROWS = 48
_STEP = 2
"""Every second view and phase of the bank is searched."""

_GAIN_BODY, _GAIN_BLOB = 0.3, 0.15
"""Shares by which the matched body and the blob move the box that is matched about."""

_ASPECT = 0.4

_MATCHING = MatchingConfig(
    shifts_x=3, shifts_y=5, scales=3, shift_step=0.045, scale_step=0.1, levels=4, scale_cost=0.1
)


class Watch:
    """
    Follows one candidate with a matcher of its own, and adds up the evidence that it walks.

    The log-odds of each match, times the time since the last one, are added up and never fall
    below zero, as in Page's cumulative sum test: who begins to walk is found as soon as somebody
    new, and what is doubtful must walk for longer.  ``evidence`` is that sum in seconds, and
    ``measures`` are those of the last match, None while there are too few.
    """

    def __init__(
        self, bank: TemplateBank, candidate: Candidate, likelihood: NDArray[np.uint8]
    ) -> None:
        """
        Begin to watch.

        :param bank: from :func:`light_bank`.
        :param likelihood: (h, w) uint8, 255 = surely no background.
        """
        self._matcher = SequenceMatcher(bank, _MATCHING)
        self._blob = candidate.box
        self._box = seat(likelihood, candidate.box)
        self._shapes: deque[tuple[float, Shape]] = deque()
        self.last = 0.0
        self.evidence = 0.0
        self.measures: dict[str, float] | None = None
        self.box: Box | None = None

    def due(self, seconds: float) -> bool:
        """Tell whether it is time to match again."""
        return seconds - self.last >= _PERIOD_S

    def shift(self, dx: float, dy: float) -> None:
        """Move with the world."""
        self._box = self._box.shifted(dx, dy)
        self._blob = self._blob.shifted(dx, dy)

    def update(self, likelihood: NDArray[np.uint8], candidate: Candidate, stamp_ns: int) -> None:
        """
        Match a frame; ``box`` then is the tight box of what is matched, None if nothing is.

        :param likelihood: (h, w) uint8, 255 = surely no background.
        """
        seconds, passed = candidate.seen, min(candidate.seen - self.last, _LATE_S)
        self.last = seconds
        blob, self._blob = self._blob, candidate.box
        self._box = self._box.shifted(self._blob.center_x - blob.center_x, self._blob.y - blob.y)
        (result,) = self._matcher.update(
            likelihood,
            self._box,
            stamp_ns,
            track_id=candidate.number,
            source_size=(likelihood.shape[1], likelihood.shape[0]),
        )
        body = result.body
        assert body is not None
        self._box = _between(self._box, body, candidate.box)
        self._shapes.append((seconds, Shape.of(likelihood, result)))
        while seconds - self._shapes[0][0] > _WINDOW_S:
            self._shapes.popleft()
        self.box, cover = person_box(likelihood, result)
        self.measures = None
        if self.box is None or len(self._shapes) < LEAST_SHAPES:
            return
        self.measures = measures_of([shape for _, shape in self._shapes]) | {
            'cover': cover,
            'width': abs(math.log(candidate.box.width / (_ASPECT * body.height))),
        }
        self.evidence = max(self.evidence + passed * log_odds(self.measures), 0.0)

    def walks(self, candidate: Candidate, config: StartingConfig) -> bool:
        """Tell whether the evidence is enough, and some way has been seen."""
        return (
            self.measures is not None
            and self.evidence >= config.least_evidence
            and candidate.distance() >= config.least_way
        )


def _between(box: Box, body: BodyFrame, blob: Box) -> Box:
    """Move a box towards the matched body, and a little towards the blob."""
    rest = 1 - _GAIN_BODY - _GAIN_BLOB
    height = box.height**rest * body.height**_GAIN_BODY * blob.height**_GAIN_BLOB
    return Box.from_center(
        rest * box.center_x + _GAIN_BODY * body.center_x + _GAIN_BLOB * blob.center_x,
        rest * box.center_y + _GAIN_BODY * body.center_y + _GAIN_BLOB * blob.center_y,
        _ASPECT * height,
        height,
    )


def light_bank(bank: TemplateBank) -> TemplateBank:
    """Return a smaller bank to search with: its first build, fewer views, phases and pixels."""
    chosen = [k for k, build in enumerate(bank.builds) if build == bank.builds[0]]
    if len(chosen) >= 8 * _STEP:
        chosen = chosen[::_STEP]
    step = _STEP if bank.phases >= 8 * _STEP else 1
    templates = bank.templates[chosen][:, ::step]
    rows, columns = bank.grid
    if rows > _ROWS:
        size = (max(1, round(columns * _ROWS / rows)), _ROWS)
        templates = np.stack(
            [
                [cv2.resize(one, size, interpolation=cv2.INTER_AREA) for one in cycle]
                for cycle in templates
            ]
        )
    return TemplateBank(
        np.ascontiguousarray(templates),
        bank.azimuth[chosen],
        tuple(bank.builds[k] for k in chosen),
        bank.fill,
    )
