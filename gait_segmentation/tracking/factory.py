# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How a track is made: in a view in which the person is well seen, with a first mask."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import count
from operator import itemgetter

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.detector.detection import Detection, SoftMask
from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.geometry import Box, body_window
from gait_segmentation.heat_maps import own_regions, regions
from gait_segmentation.images import Window, placed, within
from gait_segmentation.scene.scene import Scene, View, WholeView
from gait_segmentation.scene.working import working_scale
from gait_segmentation.starting import FirstMask, estimate_first_mask
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.cues.heat_map import map_evidence
from gait_segmentation.tracking.existence import Existence
from gait_segmentation.tracking.fusion import FusionTrack
from gait_segmentation.tracking.likelihood import place_shown
from gait_segmentation.tracking.mean_shift import MeanShiftTrack, start_in
from gait_segmentation.tracking.track import Track

_FILLS = 0.7
"""Intersection over union of a box and that of what a map shows in it which is then the person."""

_SOLID = 0.3
"""Least share of its box that a person has."""

_RIM = 0.05
"""How far about the box of a region of a map its person may be, in body heights."""

_ABOUT = 0.3
"""How far about a person found the place is remembered, in body heights."""


def estimate_first(
    view: View,
    box: Box,
    past: WholeView | None,
    bank: TemplateBank,
    config: TrackingConfig,
    drawn: SoftMask | None = None,
    *,
    by_map: bool = False,
) -> FirstMask:
    """
    Estimate a first mask before what the camera has seen of the place; the box may be off.

    :param view: in which the person is well seen; it forgets what is under the mask and takes
        over what is remembered of the place.
    :param box: in working pixels, in the view's newest frame.
    :param past: the place as it was before that frame, if it is known.
    :param drawn: the mask that a network draws of the person, if one does.
    :param by_map: whether the heat map of that frame is what tells of the person.
    """
    area = body_window(box.center_x, box.center_y, box.height, box)
    area = area.padded(_ABOUT * box.height, _ABOUT * box.height)
    window = area.slices(view.shape[1], view.shape[0])
    known = None if past is None else past.known(view.shape)
    evidence = np.zeros(view.shape, np.float32)
    frame = view.now
    if known is not None:
        lab = frame.image.lab_part(window)
        place = place_shown(known, lab, window, config)
        evidence[window] = place.evidence(lab, config.shadow_floor)
    shown, own, trust = None, None, 1.0
    there = box.slices(view.shape[1], view.shape[0])
    if drawn is not None:
        own = drawn.drawn(window, view.scale, (0.0, 0.0))
    elif view.heat is not None and view.heat.trust and not view.heat.frames:
        inside = np.zeros(view.shape, np.uint8)
        inside[there] = 255
        own, trust = own_regions(view.heat.values[window], inside[window]), view.heat.trust
        # Who touches somebody whom a map tells of is in the same region.
        own = _about(box, own, view, window) if by_map else own
    if own is not None:
        part = (own > 127)[within(there, window)]
        fills = by_map or _fills(own, box.shifted(-window[1].start, -window[0].start))
        rows = 1.0 if fills else float(part.any(axis=1).mean())
        logit = map_evidence(own, trust, rows)
        evidence[window] += logit
        shown = logit if fills else None
    start = estimate_first_mask(
        frame.image.lab, box, bank, use_tilt=config.use_tilt, evidence=evidence
    )
    if shown is not None and trust > 0.5:
        start = _as_shown(start, shown, window)
    view.background.forget(start.mask)
    if known is not None:
        view.background.merge(known)
    return start


def _about(box: Box, values: NDArray[np.uint8], view: View, window: Window) -> NDArray[np.uint8]:
    """Return a map, (h, w) uint8 of a window of a view, without what is not about a box."""
    limits = box.padded(_RIM * box.height, _RIM * box.height)
    near = within(limits.slices(view.shape[1], view.shape[0]), window)
    return placed(values[near], near, values.shape)


def _fills(values: NDArray[np.uint8], box: Box) -> bool:
    """Return whether one region of a map, (h, w) uint8, fills a tight box as a person does."""
    region, area = max(regions(values), key=itemgetter(1), default=(None, 0))
    if region is None or region.iou(box) < _FILLS:
        return False
    return area > _SOLID * region.width * region.height


def _as_shown(start: FirstMask, logit: NDArray[np.float32], window: Window) -> FirstMask:
    """
    Return a start with the mask that a heat map shows.

    By the silhouette there a person is known for a body, while the box may hold a cabinet as well
    that continues them.

    :param logit: (h, w) float32 of the window, what the map says.
    """
    votes = np.zeros(start.votes.shape, np.float32)
    votes[window] = 1 / (1 + np.exp(-logit))
    return replace(start, mask=np.where(votes > 0.5, np.uint8(255), np.uint8(0)), votes=votes)


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
