# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Watching one candidate until the matcher and its gait say that it walks."""

from __future__ import annotations

from collections import deque

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.geometry import BodyFrame, Box
from gait_segmentation.matching import MatchingConfig, SequenceMatcher
from gait_segmentation.results import MatchResult
from gait_segmentation.starting.config import StartingConfig
from gait_segmentation.starting.finding.candidates import Candidate
from gait_segmentation.starting.finding.gait import Gait, Shape, gait_of, person_box
from gait_segmentation.starting.finding.seat import seat

__all__ = ['Watch', 'light_bank']

_PERIOD_S, _LONG_PERIOD_S = 0.06, 0.24
"""Time between two frames in which a candidate is matched: likely ones, and others."""

_HOPELESS = 0.75
"""Share of the least similarity below which a candidate is not likely."""

_ROWS = 48
_PHASE_STEP, _VIEW_STEP = 2, 2
_GAIN_BODY, _GAIN_BLOB = 0.3, 0.15
"""Shares by which the matched body and the blob move the box that is matched about."""

_ASPECT = 0.4
_POOR = 1.0
"""Share of the least similarity below which a match is poor."""

_OFF = 0.6
"""Overlap with where the blob shows a body below which a poor match is not of that body."""

_MISSES = 3
"""Such matches in a row after which what is matched is taken to be wrong."""

_MATCHING = MatchingConfig(
    shifts_x=3, shifts_y=5, scales=3, shift_step=0.045, scale_step=0.1, levels=4, scale_cost=0.1
)

_LEAST_SWING = 0.2
_LEAST_RATIO, _TRUNK_NOISE = 1.1, 0.1
"""The legs must change by so much more than the trunk and this."""

_LEAST_STEPS, _LEAST_ACCORD, _MOST_SWAY = 0.4, 0.4, 0.2
_SLOWEST, _FASTEST = 0.5, 1.6
"""Who walks in step with the templates: how much their legs swing, how well the legs agree with
them, and how much the trunk may, as that of what only changes its size; and strides a second."""

_STEP_WAY, _STEP_S = 0.3, 0.4
"""Share of the way asked for that is enough for who walks in step for so long, as before a camera
that goes along with him, past a wall without texture."""

_LEAST_LEGS, _MOST_LEGS = 0.55, 2.2
_MOST_PLAIN = 0.82
_VERY_SURE, _SURE_PLAIN = 1.3, 0.88
"""How much more like a walker something must be to look as plain as small people do."""

_MOST_RIGID = 0.22
"""How much more the legs may be like those of other times than like those of a walker."""

_LEAST_COVER = 0.7
_MOST_WIDTH = 1.1
_SURE, _SURE_RATIO, _SURE_LEGS, _SURE_SLACK = 1.2, 0.9, 0.42, 0.12
"""How much more like a walker something must be than the least, for the limits that follow to do
for it: people from the front swing less, and show more of the trunk."""

_AGREE = 2
"""Matches in a row that must say the same."""

_DOUBTED, _DOUBT_S = 1.12, 0.12
"""How much more like a walker than the least something must be not to be doubted, and for how
long matches must say the same of what is."""

_BORDER_PX = 1.0
_SLACK = 0.05
"""How far the matched body may reach out at the top and bottom, in body heights."""


class Watch:
    """Follows one candidate with a matcher of its own and judges what it sees."""

    def __init__(
        self,
        bank: TemplateBank,
        config: StartingConfig,
        candidate: Candidate,
        box: Box | None = None,
    ) -> None:
        """
        Begin to watch.

        :param bank: from :func:`light_bank`.
        :param box: where to look for the body first; that of the candidate if None.
        """
        self._config = config
        self._matcher = SequenceMatcher(bank, _MATCHING)
        self._blob = candidate.box
        self._box = candidate.box if box is None else box
        self._seen: deque[tuple[float, MatchResult, Shape]] = deque()
        self._agreed, self._since = 0, 0.0
        self._in_step: float | None = None
        self._missed = 0
        self.begun = candidate.seen
        self.last = 0.0
        self.gait: Gait | None = None
        self.similarity = 0.0

    @property
    def agreed(self) -> bool:
        """Return whether the last match said that it walks, and the next may be enough."""
        return self._agreed > 0

    @property
    def astray(self) -> bool:
        """Return whether what is matched is not the body that the blob shows."""
        return self._missed >= _MISSES

    def due(self, seconds: float) -> bool:
        """Tell whether it is time to match again."""
        likely = self.gait is None or self.similarity >= _HOPELESS * self._config.least_similarity
        likely = likely and not (self.astray and seconds - self.begun > self._config.watch)
        return seconds - self.last >= (_PERIOD_S if likely else _LONG_PERIOD_S)

    def shift(self, dx: float, dy: float) -> None:
        """Move with the canvas."""
        self._box = self._box.shifted(dx, dy)
        self._blob = self._blob.shifted(dx, dy)

    def update(
        self, likelihood: NDArray[np.uint8], candidate: Candidate, stamp_ns: int
    ) -> Box | None:
        """
        Match a frame.

        :param likelihood: (h, w) uint8, 255 = surely no background.
        :returns: the tight box of the candidate if it walks.
        """
        seconds = self.last = candidate.seen
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
        self._missed = self._missed + 1 if self._misses(likelihood, candidate, result) else 0
        self._box = _between(self._box, body, candidate.box)
        shape = Shape.of(likelihood, result.shape_prior, body)
        self._seen.append((seconds, result, shape))
        while seconds - self._seen[0][0] > self._config.watch + _PERIOD_S:
            self._seen.popleft()
        if seconds - self._seen[0][0] < self._config.watch - _PERIOD_S:
            return None
        found = self._judge(likelihood, candidate, result)
        if found is None:
            self._agreed = 0
            return None
        if self._agreed == 0:
            self._since = seconds
        self._agreed += 1
        doubted = self.similarity < _DOUBTED * self._config.least_similarity
        sure = not doubted or seconds - self._since >= _DOUBT_S
        return found if sure and self._agreed >= _AGREE else None

    def _misses(
        self, likelihood: NDArray[np.uint8], candidate: Candidate, result: MatchResult
    ) -> bool:
        """Tell whether a match is poor, and not of the body that the blob shows."""
        body = result.body
        if body is None or result.similarity >= _POOR * self._config.least_similarity:
            return False
        matched = Box.from_center(body.center_x, body.center_y, _ASPECT * body.height, body.height)
        return matched.iou(seat(likelihood, candidate.box)) < _OFF

    def _judge(
        self, likelihood: NDArray[np.uint8], candidate: Candidate, result: MatchResult
    ) -> Box | None:
        config = self._config
        self.gait = gait = gait_of([shape for _, _, shape in self._seen])
        self.similarity = float(np.mean([match.similarity for _, match, _ in self._seen]))
        sure = self.similarity >= _SURE * config.least_similarity
        very = self.similarity >= _VERY_SURE * config.least_similarity
        ratio, least_legs = (_SURE_RATIO, _SURE_LEGS) if sure else (_LEAST_RATIO, _LEAST_LEGS)
        in_step = self._walks_in_step(gait)
        far = self._far_enough(candidate, in_step)
        walks = (
            self.similarity >= config.least_similarity
            and gait.swing >= _LEAST_SWING
            and (
                gait.swing >= ratio * (gait.trunk + _TRUNK_NOISE)
                or (in_step and gait.swing >= gait.trunk)
            )
            and least_legs <= gait.legs <= _MOST_LEGS
            and gait.plain <= (_SURE_PLAIN if very else _MOST_PLAIN)
            and gait.rigid <= _MOST_RIGID
            and far
        )
        if not walks or result.body is None:
            return None
        if candidate.box.width > _MOST_WIDTH * result.body.height:
            return None
        box, cover = person_box(likelihood, result)
        if box is None or cover < _LEAST_COVER:
            return None
        height, width = likelihood.shape
        slack = (_SURE_SLACK if sure else _SLACK) * result.body.height
        foot, head = (result.body.center_y + side * result.body.height / 2 for side in (1, -1))
        inside = head >= -slack and foot <= height + slack
        return box if inside and box.x >= _BORDER_PX and box.right <= width - _BORDER_PX else None

    def _walks_in_step(self, gait: Gait) -> bool:
        """Tell whether the legs step as those of the templates do, at the pace of a walker."""
        if gait.steps < _LEAST_STEPS or gait.accord < _LEAST_ACCORD or gait.sway > _MOST_SWAY:
            return False
        times = np.array([seconds for seconds, _, _ in self._seen])
        phases = np.unwrap([match.phase for _, match, _ in self._seen], period=1.0)
        if len(times) < 3:
            return False
        times -= times.mean()
        pace = abs(float((times * phases).sum() / (times**2).sum()))
        return _SLOWEST <= pace <= _FASTEST

    def _far_enough(self, candidate: Candidate, in_step: bool) -> bool:
        """Tell whether it has come as far as it must, which is less once it walks in step."""
        if not in_step:
            self._in_step = None
        elif self._in_step is None:
            self._in_step = candidate.seen
        least = self._config.least_way
        if self._in_step is not None and candidate.seen - self._in_step >= _STEP_S:
            least *= _STEP_WAY
        return candidate.distance() >= least


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
    if len(chosen) >= 8 * _VIEW_STEP:
        chosen = chosen[::_VIEW_STEP]
    step = _PHASE_STEP if bank.phases >= 8 * _PHASE_STEP else 1
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
