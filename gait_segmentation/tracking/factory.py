# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How a track is made: in a view in which the person is well seen, with a first mask."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import count

from gait_segmentation.detector.detection import Detection
from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.geometry import Box
from gait_segmentation.scene.scene import Scene, View, WholeView
from gait_segmentation.scene.working import working_scale
from gait_segmentation.starting import FirstMask
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.existence import Existence
from gait_segmentation.tracking.fusion import FusionTrack
from gait_segmentation.tracking.initialization import estimate_first
from gait_segmentation.tracking.mean_shift import MeanShiftTrack, start_in
from gait_segmentation.tracking.track import Track

_METHODS: dict[str, tuple[Callable[..., FirstMask], type[FusionTrack] | type[MeanShiftTrack]]] = {
    'fusion': (estimate_first, FusionTrack),
    'adaptive_mean_shift': (start_in, MeanShiftTrack),
}
"""How a track begins, and its class, by ``tracking.method``."""

_MOST_APART = 1.5
"""Ratio of the scales of people who share a view."""


class TrackFactory:
    """Makes tracks, each with an id of its own."""

    def __init__(self, bank: TemplateBank, config: TrackingConfig) -> None:
        self.config = config
        self._bank, self._ids = bank, count(1)

    def estimate(
        self,
        scene: Scene,
        detection: Detection,
        views: Sequence[View],
        past: WholeView | None,
        view: View | None = None,
    ) -> tuple[View, FirstMask]:
        """
        Return a view of the scene for somebody who was detected, and their first mask in it.

        :param views: those in use; the others of the scene are let go of.
        :param past: the place as it was before, if it is known.
        :param view: the view to take, if it is given.
        """
        scene.keep(views)
        view = view or self._view_for(scene, detection.box, views)
        box, by_map = self.tight(detection).scaled(view.scale), detection.by_map
        estimate, bank, config = _METHODS[self.config.method][0], self._bank, self.config
        return view, estimate(view, box, past, bank, config, detection.mask, by_map=by_map)

    def make(
        self,
        view: View,
        start: FirstMask,
        detection: Detection,
        existence: Existence,
        *,
        slot: int | None,
        number: int | None = None,
    ) -> Track:
        """Return a track of somebody who was detected, with a new id if they have none."""
        track = _METHODS[self.config.method][1](
            next(self._ids) if number is None else number,
            view,
            start,
            self.config,
            existence=existence,
            outlined=detection.by_map or detection.mask is not None,
            slot=slot,
            by_map=slot is None and detection.by_map,
        )
        if detection.mask is not None:
            track.take_mask(detection.mask, detection.box)
        return track

    def tight(self, detection: Detection) -> Box:
        """Return a box without the margin that those have which others draw."""
        box, margin = detection.box, self.config.box_margin
        return box if detection.by_map else box.padded(-margin * box.width, -margin * box.height)

    def scale_for(self, source: tuple[int, int], height: float) -> float:
        """Return the scale at which a person of a height in source pixels is tracked."""
        size, working = self.config.working_size, self.config.working_height
        return working_scale(
            *source, working_size=size, person_height=height, working_height=working
        )

    def _view_for(self, scene: Scene, box: Box, views: Sequence[View]) -> View:
        scale = self.scale_for(scene.source, box.height)
        for view in views:
            if 1 / _MOST_APART <= view.scale / scale <= _MOST_APART:
                return view
        view = View(scene.source, scale)
        scene.add(view)
        return view
