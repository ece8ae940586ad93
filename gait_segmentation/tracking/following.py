# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A person followed into the newest frame: moved, and assessed by what the pixels say."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.ego_motion.world_motion import WorldMotion
from gait_segmentation.images import Window
from gait_segmentation.tracking.competition import Claim
from gait_segmentation.tracking.mean_shift import mean_shift
from gait_segmentation.tracking.person.pace import STEADY_AFTER, is_astray
from gait_segmentation.tracking.records import Shift
from gait_segmentation.tracking.recovery.visibility import (
    CLEAR_ENOUGH,
    LOST_BELOW,
    Sight,
    likely_rows,
)
from gait_segmentation.tracking.target import Target

__all__ = ['assess', 'move']

_STEADY_RATE = 1 / 3
"""Share of the usual by which the pace changes while somebody else is near."""

_LEAST_STEP_S = 0.005
"""Frames whose stamps are closer have not been taken in so short a time: no pace is learnt."""

_MOST_MEAN_SHIFT = 0.05
"""Largest mean shift in a frame, in body heights."""


def move(
    target: Target,
    motion: WorldMotion,
    body: NDArray[np.uint8] | None,
    *,
    company: bool = False,
) -> None:
    """
    Follow the body into the world's newest frame.

    :param motion: of the world.
    :param body: what can be followed carried to the frame before, in the window about the
        person, without what others hid there; None of somebody lost.
    :param company: whether somebody without a slot may be in the way.
    """
    person, now = target.person, target.world.now
    x, y = motion.carry(person.center_x, person.center_y)
    world = (x - person.center_x, y - person.center_y)
    seconds = target.world.step_s
    if company:
        now.company.add(target.track_id)
    if body is None:
        shift = target.memory.coast(person, world, seconds, target.world.shape)
    else:
        shift = _follow(target, world, seconds, body)
        target.guard.carry(world, seconds)
    now.bodies[target.track_id] = shift


def _follow(target: Target, world: Shift, seconds: float, body: NDArray[np.uint8]) -> Shift:
    """Move the person with the body, or at the pace of before; return the shift made."""
    person, pace, well = target.person, target.memory.pace, target.visibility.well
    # Of the step between the frames before, which need not have been as long.
    ratio = target.world.step_ratio
    person.velocity = (ratio * person.velocity[0], ratio * person.velocity[1])
    measured = None
    # Of somebody behind others it may be their motion.
    if well or target.uncovered:
        measured = target.world.body_shift(body, target.window, person.velocity)
    way = (pace[0] * seconds, pace[1] * seconds)
    usual = (world[0] + way[0], world[1] + way[1])
    known = person.moves >= STEADY_AFTER
    if (
        known
        and measured is not None
        and is_astray(
            measured,
            usual,
            math.hypot(*way),
            person.height,
            company=target.accompanied,
            hidden=not well,
        )
    ):
        measured = None
    if measured is None:
        person.velocity = way
    shift = person.predict(world, measured)
    if measured is not None and seconds > _LEAST_STEP_S:
        share = _STEADY_RATE if known and target.accompanied else 1.0
        x, y = (u + share * (s - u) for s, u in zip(shift, usual, strict=True))
        target.memory.learn_pace((x, y), world, seconds)
    return shift


def assess(
    target: Target,
    likelihood: NDArray[np.uint8],
    claim: Claim,
    cover: NDArray[np.uint8] | None,
) -> None:
    """
    See how well the person stands out, and refine the place by mean shift.

    :param likelihood: (h, w) uint8 of the working image.
    :param claim: what was made of the pixels where the person is expected.
    :param cover: (h, w) uint8 of its window, non-zero where others hide the person.
    """
    person, visibility, window = target.person, target.visibility, claim.window
    values = likelihood[window]
    sight = Sight.of(values, claim.mask, cover)
    target.note(sight)
    clear = 0.0
    if sight.seen < LOST_BELOW and target.uncovered:
        clear = _clear(target, sight, values, claim, cover)
    inside = person.share_inside(target.world.shape)
    if not visibility.update(sight.seen, inside, clear):
        if visibility.is_lost:
            target.lose()
        return
    if visibility.well and not target.accompanied:
        # Likely pixels of both would pull the person towards the other.
        _mean_shift(target, values, sight.uncovered, window)
    target.see(values, sight, claim)
    center = (person.center_x - window[1].start, person.center_y - window[0].start)
    rows = likely_rows(values, claim.near, center, person.height, person.angle)
    if rows is not None:
        target.world.now.rows[target.track_id] = rows


def _clear(
    target: Target,
    sight: Sight,
    values: NDArray[np.uint8],
    claim: Claim,
    cover: NDArray[np.uint8] | None,
) -> float:
    """
    Return the share of the person that cannot be anything else.

    In the last mask, or else in that and the template: a mask ends at the pole that the body
    goes on behind, to come forth on its other side.
    """
    clear = target.clear_sight(sight, values, claim.window).seen
    template = target.carried_template(claim.window)
    if clear >= CLEAR_ENOUGH or template is None:
        return clear
    whole = cv2.bitwise_or(claim.mask, cv2.inRange(template, 128, 255))
    return target.clear_sight(Sight.of(values, whole, cover), values, claim.window).seen


def _mean_shift(
    target: Target, values: NDArray[np.uint8], reference: NDArray[np.uint8], window: Window
) -> None:
    """Move the person to where the likely pixels are."""
    person = target.person
    box = person.box.shifted(-window[1].start, -window[0].start)
    shift = mean_shift(values, reference, box)
    gain = target.config.mean_shift_gain
    limit = _MOST_MEAN_SHIFT * person.height
    dx = gain * min(max(shift.dx, -limit), limit)
    dy = gain * min(max(shift.dy, -limit), limit)
    target.shift_now(dx, dy)
    if len(target.world.pending) > 1:
        # The last mask is not of the last frame: until a newer one comes, this is the size.
        person.follow_scale(shift.scale)
