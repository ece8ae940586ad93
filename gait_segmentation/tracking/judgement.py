# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What all cues together say of the pixels about a person."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.colour import colour_bins
from gait_segmentation.ego_motion.world_motion import WorldMotion
from gait_segmentation.images import Window, shifted_part, signed_distance
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.likelihood.kernels import LEAST_COUNT
from gait_segmentation.tracking.likelihood.log_ratio import log_ratio
from gait_segmentation.tracking.likelihood.spreading import spread_evidence
from gait_segmentation.tracking.person.person import Person
from gait_segmentation.tracking.records import Record, Shift
from gait_segmentation.tracking.world import World
from gait_segmentation.warping import warp_window

__all__ = ['add_motion', 'carried_template', 'judge']

_LEAST_MOTION = 0.02
"""Motion of the body relative to the world that the cue needs, in body heights."""

_FADE = 10
"""
Masks after which spread evidence weighs 1/e of what it does at first, or when somebody was found
again, since what surrounds the person is known better then.
"""

_UNCOVERED = -1.0
"""Evidence from motion (-2..2) where the body has uncovered the world."""

_FOUND = 4
"""Masks after which what the first one missed has mostly been found by its motion."""

_SETTLED = 2 * _FADE
"""
Masks until which there may be ghosts: later a body that was hidden would be taken for one when it
comes forth.
"""

_RESIDUAL_SIGMA = 12.0
_RESIDUAL_LIMIT = 2.0
_PROPAGATION_SLOPE = 0.02
_PROPAGATION_LIMIT = 3.0


def judge(
    person: Person,
    world: World,
    expected: NDArray[np.uint8],
    config: TrackingConfig,
    *,
    seen: bool,
    propagate: bool,
) -> tuple[Window, NDArray[np.float32], NDArray[np.float32]] | None:
    """
    Judge the pixels of the newest frame in a window about a person.

    :param expected: (h, w) uint8 0/255 of that window, where the person is expected.
    :param seen: whether the person was seen until now: else nothing is known of the motion.
    :param propagate: whether being expected somewhere is evidence.
    :returns: the window, its log-likelihood ratios, (h, w) float32, and how far its pixels are
        from the outline of the person expected, likewise, positive inside; None if all of the
        window is outside of the image.
    """
    record = world.now
    window = person.window(world.shape)
    if window[0].start >= window[0].stop or window[1].start >= window[1].stop:
        return None
    lab = record.image.lab_part(window)
    bins, rows = colour_bins(lab), person.rows(window)
    logit = log_ratio(
        lab,
        bins,
        rows,
        window,
        record.background,
        person.person,
        person.surroundings,
        config,
    )
    if config.use_motion_cue and seen:
        _add_motion(logit, person, world, window, config.motion_weight)
    if seen:
        _add_spread(logit, person, world, lab, window, config)
    if record.heat is not None and person.track_id > 0:
        _add_heat_map(logit, person, world, window, seen=seen)
    near = signed_distance(expected > 127)
    if propagate:
        add_propagation(logit, near, person.height, config.propagation_weight)
    return window, logit, near


def _add_heat_map(
    logit: NDArray[np.float32], person: Person, world: World, window: Window, *, seen: bool
) -> None:
    """Add the evidence from a heat map to that of all else, and note its part in the frame."""
    record = world.now
    assert record.heat is not None
    moved = world.body_since(person.track_id, record.heat_frames)
    if seen:
        likely = np.asarray(1 / (1 + np.exp(-logit)), np.float32)
        person.heat_map.place(record.heat, window, likely, person.height, moved)
    part = person.heat_map.part(record.heat, window, moved)
    record.heat_parts[person.track_id] = (window, part)
    logit += person.heat_map.evidence(part)


def carried_template(person: Person, world: World, window: Window) -> NDArray[np.uint8] | None:
    """
    Return a window of the last template, carried along with the body; None without one.

    :returns: (h, w) uint8, contiguous.
    """
    if person.template is None:
        return None
    return np.ascontiguousarray(world.carried(person.template, person.track_id, window))


def _add_motion(
    logit: NDArray[np.float32], person: Person, world: World, window: Window, weight: float
) -> None:
    """Add the evidence from motion, if there is any, and note it in the newest frame."""
    record = world.now
    motions = _motions(person, world)
    if motions is None:
        return
    earlier, motion, (dx, dy) = motions
    body = np.array([[1.0, 0.0, dx], [0.0, 1.0, dy]])
    moving = add_motion(logit, record.image.gray, earlier.image.gray, motion, body, window, weight)
    if earlier.people is not None and _FOUND <= person.learnt_anew <= _SETTLED:
        unseen = record.background.count[window] < LEAST_COUNT
        there = motion.warped(earlier.people, window, cv2.BORDER_CONSTANT)
        along = shifted_part(earlier.people, round(dx), round(dy), window)
        kept = _take_back_uncovered(there, along, unseen, moving)
        logit += np.float32(weight) * (kept - moving)
        moving = kept
    record.moving[person.track_id] = (window, moving)


def _motions(person: Person, world: World) -> tuple[Record, WorldMotion, Shift] | None:
    """Return an earlier frame, and how world and body moved since; None if the body stays."""
    motions = world.motions_of(person.track_id)
    if motions is None:
        return None
    _, motion, shift = motions
    far = math.hypot(*_way(person, motion, shift)) >= _LEAST_MOTION * person.height
    return motions if far else None


def _way(person: Person, motion: WorldMotion, shift: Shift) -> tuple[float, float]:
    """Return how far the body went against the world, right and down in pixels."""
    x, y = motion.carry(person.center_x - shift[0], person.center_y - shift[1])
    return person.center_x - x, person.center_y - y


def _take_back_uncovered(
    there: NDArray[np.uint8],
    along: NDArray[np.uint8],
    unseen: NDArray[np.bool_],
    moving: NDArray[np.float32],
) -> NDArray[np.float32]:
    """
    Return what motion says for the person without what the body has uncovered and is unknown.

    That it looks otherwise than an earlier frame did there tells nothing, since somebody was in
    front of it.  If the body brought it along, it was in the mask then.

    :param there: (h, w) uint8, above 127 where people may have been in the earlier frame, carried
        with the camera.
    :param along: (h, w) uint8, the same carried with the body.
    :param unseen: (h, w), where the background was never seen.
    :param moving: (h, w) float32, the evidence (-2..2) that pixels move with the body.
    """
    uncovered = (there > 127) & (along <= 127) & unseen & (moving > 0)
    return np.where(uncovered, np.float32(_UNCOVERED), moving)


def _add_spread(
    logit: NDArray[np.float32],
    person: Person,
    world: World,
    lab: NDArray[np.uint8],
    window: Window,
    config: TrackingConfig,
) -> None:
    """
    Add, in the first masks, what is known nearby where the background was never seen.

    Not of somebody who stands: nothing is uncovered then, and clothes without edges are worn down.
    """
    share = math.exp(-person.learnt_anew / _FADE)
    record = world.now
    moving = record.moving.get(person.track_id)
    if person.learnt_anew > _SETTLED or moving is None or not config.spread_weight:
        return
    template = carried_template(person, world, window)
    if template is None:
        return
    logit += np.float32(config.spread_weight * share) * spread_evidence(
        lab,
        record.background,
        window,
        moving[1],
        template,
        person.height,
        config.shadow_floor,
    )


def add_motion(
    logit: NDArray[np.float32],
    gray: NDArray[np.uint8],
    earlier: NDArray[np.uint8],
    motion: WorldMotion,
    body: NDArray[np.float64],
    window: Window,
    weight: float,
) -> NDArray[np.float32]:
    """
    Add the evidence that pixels move with the body rather than stay with the world.

    An earlier frame is carried to this one twice, with the world and with the body; a pixel
    belongs to the one that explains it better.  Limited to +-2 times the weight.

    :param logit: (h, w) float32 of the window, changed.
    :param gray: (H, W) uint8 brightness of this frame.
    :param earlier: (H, W) uint8, that of a frame some frames back.
    :param motion: of the still world from then to now.
    :param body: 2 x 3 transform of positions on the body, likewise.
    :param window: the window's rows and columns.
    :returns: the evidence itself, (h, w) float32 within +-2.
    """
    stays = motion.warped(earlier, window)
    moves = warp_window(earlier, body, window)
    stay, move = (
        np.square(cv2.blur(cv2.absdiff(gray[window], each), (3, 3)), dtype=np.float32)
        for each in (stays, moves)
    )
    evidence = np.clip((stay - move) / (2 * _RESIDUAL_SIGMA**2), -_RESIDUAL_LIMIT, _RESIDUAL_LIMIT)
    logit += np.float32(weight) * evidence
    return evidence


def add_propagation(
    logit: NDArray[np.float32], near: NDArray[np.float32], height: float, weight: float
) -> None:
    """
    Add the weak prior from the last mask; limited to +-3 times the weight.

    :param logit: (h, w) float32 of a window, changed.
    :param near: (h, w) float32, how far its pixels are from the outline of the last mask carried
        to this frame, positive inside.
    :param height: height of the body in pixels.
    """
    limit = weight * _PROPAGATION_LIMIT
    logit += np.clip(near * np.float32(weight / (_PROPAGATION_SLOPE * height)), -limit, limit)
