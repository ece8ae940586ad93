# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The people of one world: followed, judged and learnt together, since they may overlap."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.colour import NO_CHROMA, NO_GRADIENT
from gait_segmentation.heat_maps import HeatMap
from gait_segmentation.images import Window, overlap, size_of, within
from gait_segmentation.results import LOST, TRACKED, Feedback
from gait_segmentation.tracking.competition import compete
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.learning import grown, learn as teach
from gait_segmentation.tracking.likelihood import likelihood_image
from gait_segmentation.tracking.redetection import recover
from gait_segmentation.tracking.target import Target
from gait_segmentation.tracking.world import World

_GAP_S = 0.5
"""Time between two frames from which on nobody is followed from one to the other."""

Likelihoods = dict[int, NDArray[np.uint8]]

Place = tuple[Target, Window, NDArray[np.uint8]]
"""Where somebody is expected: rows and columns about them, and (h, w) uint8 0/255 of these."""


def follow(
    world: World,
    targets: Sequence[Target],
    image: NDArray[np.uint8],
    stamp_ns: int,
    config: TrackingConfig,
    heat: HeatMap | None = None,
) -> None:
    """
    Take a frame into a world and follow its people.

    After a gap they are lost, to be looked for from where they were: nothing tells how they went.

    :param targets: all people of the world.
    :param image: (H, W, 3) uint8 BGR.
    :param heat: P(person) from elsewhere, of this frame or one before.
    """
    if world.gap_s(stamp_ns) > _GAP_S:
        for target in targets:
            target.stay()
    seen = [target for target in targets if target.state == TRACKED]
    masks = [(target, target.window, target.carried_mask()) for target in seen]
    visible = {
        target.track_id: _uncovered(target, target.carried_part(), masks) for target in seen
    }
    motion = world.advance(
        image,
        stamp_ns,
        [target.person.area for target in targets],
        camera=config.use_ego_motion,
        texture=config.use_texture,
        everywhere=len(seen) < len(targets),
        heat=heat,
    )
    for target in targets:
        if world.fades:
            target.fade(NO_GRADIENT if world.now.image.textured else NO_CHROMA)
        target.follow(motion, visible.get(target.track_id))


def judge(world: World, targets: Sequence[Target]) -> Likelihoods:
    """
    Let people compete for pixels, assess each by what it got, and look for the lost.

    :param targets: all people of the world.
    :returns: the likelihoods, (h, w) uint8, by track id.
    """
    likelihoods: Likelihoods = {}
    if world.now.blank:
        for target in targets:
            target.miss()
        return likelihoods
    _notice_jolt(world, targets)
    judged = [(target, target.judge()) for target in targets]
    present = [(target, claim) for target, claim in judged if claim is not None]
    logits = [claim.logit for _, claim in present]
    if world.config.use_competition:
        logits = compete([claim for _, claim in present])
    for target, nothing in judged:
        if nothing is None and target.state == TRACKED:
            target.lose()
    masks: list[Place] = []
    for (target, claim), logit in zip(present, logits, strict=True):
        likelihoods[target.track_id] = likelihood_image(logit, claim.window, world.shape)
        masks.append((target, claim.window, claim.mask))
    for target, claim in present:
        if target.state == TRACKED:
            cover = _cover(target, masks, claim.window)
            target.assess(likelihoods[target.track_id], claim, cover)
    lost = [each for each in targets if each.state == LOST and each.lost_s > 0]
    if lost:
        taken = np.zeros(world.shape, np.uint8)
        for target in targets:
            if target.state == TRACKED:
                _take(taken, target, likelihoods[target.track_id])
        claims = {target.track_id: claim for target, claim in present}
        for target in lost:
            likelihood = likelihoods.get(target.track_id)
            found = recover(target, claims.get(target.track_id), likelihood, taken)
            if found is not None:
                likelihoods[target.track_id] = found
                _take(taken, target, found)
    return likelihoods


def _notice_jolt(world: World, targets: Sequence[Target]) -> None:
    """See how far the background is off in the newest frame, beside where people are expected."""
    people = np.zeros(world.shape, np.uint8)
    seen = [target for target in targets if target.state == TRACKED]
    for target in seen:
        people[target.window] |= target.carried_mask()
    if people.any():
        where, margin = grown(people, max(target.person.height for target in seen))
        people[where] = margin
        windows = [target.window for target in seen]
        world.now.background.notice_jolt(world.now.image.lab, people, windows)


def learn(
    world: World,
    targets: Sequence[Target],
    stamp_ns: int,
    by_track: Mapping[int, Feedback],
    config: TrackingConfig,
) -> None:
    """
    Learn a frame in one world: people first, then what surrounds all of them.

    :param targets: all people of the world.
    :param by_track: the masks of that frame by track id.
    """
    skipped, record = world.take(stamp_ns)
    for each in skipped:
        for target in targets:
            target.skip(each)
    if record is None:
        return
    people = np.zeros(world.shape, np.uint8)
    around: list[Window] = []
    for target in targets:
        if target.track_id not in record.bodies:
            continue
        alone = not any(target.is_near(other) for other in targets if other is not target)
        learnt = teach(target, record, by_track.get(target.track_id), alone=alone)
        if learnt is None:
            people[target.person.area.slices(world.shape[1], world.shape[0])] = 255
        else:
            window, (where, margin) = learnt
            people[where] |= margin
            around.append(window)
    if around and config.use_background:
        world.learn(record, people, around, gate=config.use_motion_gate)


def _cover(target: Target, masks: Sequence[Place], window: Window) -> NDArray[np.uint8] | None:
    """Return where in a window a person is hidden by those who stand nearer, None if nowhere."""
    cover = None
    for other, about, mask in masks:
        nearer = other is not target and other.state != LOST and other.feet > target.feet
        if nearer and (shared := overlap(about, window)) is not None:
            if cover is None:
                cover = np.zeros(size_of(window), np.uint8)
            cover[within(shared, window)] |= mask[within(shared, about)]
    return cover


def _uncovered(
    target: Target, mask: NDArray[np.uint8], masks: Sequence[Place]
) -> NDArray[np.uint8]:
    """Return the mask about a person without what others hide of it."""
    cover = _cover(target, masks, target.window)
    return mask if cover is None else np.asarray(cv2.bitwise_and(mask, cv2.bitwise_not(cover)))


def _take(taken: NDArray[np.uint8], target: Target, likelihood: NDArray[np.uint8]) -> None:
    """Mark the likely pixels where somebody is expected, in images of the working size."""
    likely = likelihood[target.window] > 127
    taken[target.window] |= np.where(likely, target.carried_mask(), 0)
