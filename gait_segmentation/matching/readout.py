# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""From the state of a path to the result of a frame."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.geometry import Box, Placement
from gait_segmentation.matching.confidence import phase_near
from gait_segmentation.matching.near_leg import NearLeg
from gait_segmentation.matching.placements import PlacementGrid, Sampled
from gait_segmentation.matching.shape_prior import warp_template
from gait_segmentation.matching.subgrid import State
from gait_segmentation.matching.views import Views
from gait_segmentation.results import MatchResult

__all__ = ['Readout', 'WaitingFrame']


@dataclass(frozen=True)
class WaitingFrame:
    """
    A frame whose result has not been emitted.

    ``seconds`` counts from the beginning of the path.  ``scale`` and ``shape`` are those of the
    likelihood, ``sampled`` is it about the box.
    """

    stamp_ns: int
    seconds: float
    track_id: int
    box: Box
    angle: float
    scale: float
    shape: tuple[int, int]
    sampled: Sampled


class Readout:
    """Makes results, frame after frame."""

    def __init__(
        self,
        bank: TemplateBank,
        templates: NDArray[np.uint8],
        placements: PlacementGrid,
        views: Views,
    ) -> None:
        """
        Keep what states mean.

        :param templates: (K, H, W) uint8, those that are matched.
        """
        self._bank, self._templates, self._placements = bank, templates, placements
        self._views = views
        self._near_leg = NearLeg()

    def reset(self) -> None:
        """Forget the walker."""
        self._near_leg.reset()

    def result(
        self,
        frame: WaitingFrame,
        state: State,
        offsets: list[float],
        belief: NDArray[np.float64],
        rate: float,
    ) -> MatchResult:
        """
        Make the result of a frame, later than the last one's.

        :param state: the path's state in it.
        :param offsets: how far the best place lies beside it, see :class:`SubgridPeak`.
        :param belief: (P,) float64, probabilities of the phases.
        :param rate: strides per second that are believed in.
        """
        sequence, phase, scale, row, column = state
        bank = self._bank
        images = frame.sampled.images
        found = cv2.countNonZero(images.reshape(-1, images.shape[2])) > 0
        placement = Placement(0.0, 0.0, 1.0)
        if found:
            placement = self._placements.placement(
                scale + offsets[2], row + offsets[3], column + offsets[4], frame.angle
            )
        azimuth = self._views.azimuth(sequence, offsets[0])
        expected = self._near_leg.expected(frame.seconds, rate)
        if expected is None:
            expected = (phase + offsets[1]) / bank.phases
        share, sure = phase_near(belief, expected)
        share = self._near_leg.update(share, azimuth, frame.seconds)
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
            similarity=self._similarity(frame.sampled, state),
            confidence=sure if found else 0.0,
            shape_prior=warp_template(
                bank.templates[sequence, phase],
                body.scaled(frame.scale),
                bank.fill,
                frame.shape,
            ),
        )

    def _similarity(self, sampled: Sampled, state: State) -> float:
        """Return the similarity of one template at one placement over the known pixels."""
        sequence, phase, scale, row, column = state
        part = (scale, *self._placements.windows.part(row, column))
        template = self._templates[sequence * self._bank.phases + phase]
        if sampled.known is not None:
            template = np.minimum(template, sampled.known[part])
        values = sampled.images[part]
        common = int(np.minimum(template, values).sum(dtype=np.int64))
        union = int(values.sum(dtype=np.int64)) + int(template.sum(dtype=np.int64)) - common
        return common / union if union else 0.0
