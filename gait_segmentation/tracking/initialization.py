# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tracks begun: the first mask in a box, and who is found again."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from operator import itemgetter

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.detector.detection import SoftMask
from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.geometry import Box, body_window
from gait_segmentation.heat_maps import own_regions, regions
from gait_segmentation.images import Window, placed, within
from gait_segmentation.scene.scene import View, WholeView
from gait_segmentation.starting import FirstMask, estimate_first_mask
from gait_segmentation.tracking.appearance import SAME_COLOURS
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.cues.heat_map import map_evidence
from gait_segmentation.tracking.likelihood import place_shown
from gait_segmentation.tracking.reidentification import FAR_COST
from gait_segmentation.tracking.track import Track

_FILLS = 0.7
"""Intersection over union of a box and that of what a map shows in it which is then the person."""

_SOLID = 0.3
"""Least share of its box that a person has."""

_BY_PLACE = 0.1
"""How much less alike a lost person may look where they are expected than far from there."""

_MOST_GROWN = 0.4
"""
The most by which the height of a lost person, as a logarithm, may be another at once, and by which
more in each second.
"""

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


def recognized(lost: Sequence[Track], view: View, start: FirstMask) -> Track | None:
    """
    Return who of those who are lost has been found again, if it is one of them.

    The farther they are expected from there, the more alike they have to look, and nobody is soon
    of another height.

    :param start: the first mask, in the newest frame of the view.
    """
    place = start.box.scaled(1 / view.scale)
    alike = [
        (track.similarity(start, view.now) + _by_place(place, track), track) for track in lost
    ]
    similarity, track = max(alike, key=itemgetter(0), default=(0.0, None))
    return track if similarity >= SAME_COLOURS else None


def _by_place(place: Box, lost: Track) -> float:
    """Return how much less alike a lost person may look in a place than as far as they can be."""
    last = lost.body
    if abs(math.log(place.height / last.height)) > _MOST_GROWN * (1 + lost.lost_s):
        return -math.inf
    away = math.hypot(place.center_x - last.center_x, place.center_y - last.center_y)
    farther = away / last.height - lost.reach
    # Who was not lost, but drawn away by something else, may be anywhere.
    return -FAR_COST * farther if farther > 0 else -_BY_PLACE * farther / lost.reach
