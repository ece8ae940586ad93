# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The people of one world: followed, judged and learnt together, since they may overlap."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import Window, overlap, placed, size_of, within
from gait_segmentation.results import LOST, TRACKED, Feedback
from gait_segmentation.tracking.competition import Claim, compete, leave_to
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.finding import recover
from gait_segmentation.tracking.following import assess, move
from gait_segmentation.tracking.learner import Learnt
from gait_segmentation.tracking.likelihood.log_ratio import likelihood_image
from gait_segmentation.tracking.outline import Outline
from gait_segmentation.tracking.records import Record
from gait_segmentation.tracking.strangers.beside import Beside
from gait_segmentation.tracking.strangers.newcomers import Neighbour
from gait_segmentation.tracking.target import Target
from gait_segmentation.tracking.teaching import teach
from gait_segmentation.tracking.world import World

__all__ = ['follow', 'judge', 'learn']

_WELL_SEEN = 0.9
"""
Share of the usual area, and of the body in the image, from which what is apart cannot be another
part of the person.
"""

Likelihoods = dict[int, NDArray[np.uint8]]

Place = tuple[Target, Window, NDArray[np.uint8]]
"""Where somebody is expected: rows and columns about them, and (h, w) uint8 0/255 of these."""


def follow(
    world: World,
    targets: Sequence[Target],
    image: NDArray[np.uint8],
    stamp_ns: int,
    config: TrackingConfig,
    heat: NDArray[np.uint8] | None = None,
) -> None:
    """
    Take a frame into a world and follow its people.

    :param targets: all people of the world.
    :param image: (H, W, 3) uint8 BGR.
    :param heat: P(person) from elsewhere, uint8 of any size.
    """
    seen = [target for target in targets if target.state == TRACKED]
    masks = [(target, target.window, target.carried_mask()) for target in seen]
    visible = {
        target.track_id: _uncovered(target, target.carried_part(), masks) for target in seen
    }
    others = world.passers_by
    company = [others.are_about(target.person, world.pending) for target in targets]
    motion = world.advance(
        image,
        stamp_ns,
        [target.person.area for target in targets],
        camera=config.use_ego_motion,
        texture=config.use_texture,
        everywhere=any(target.state == LOST for target in targets),
        heat=heat,
    )
    for target, accompanied in zip(targets, company, strict=True):
        move(target, motion, visible.get(target.track_id), company=accompanied)
    if others.known:
        others.follow(motion, world.history[-2], world.now, world.pending)


def judge(
    world: World, targets: Sequence[Target], strangers: NDArray[np.uint8] | None = None
) -> Likelihoods:
    """
    Let people compete for pixels, assess each by what it got, and look for the lost.

    :param targets: all people of the world.
    :param strangers: (h, w) uint8 of any size, non-zero where others move.
    :returns: the likelihoods, (h, w) uint8, by track id.
    """
    likelihoods: Likelihoods = {}
    if world.now.blank:
        for target in targets:
            target.miss()
        return likelihoods
    judged = [(target, target.judge()) for target in targets]
    present = [(target, claim) for target, claim in judged if claim is not None]
    masks = [(target, claim.window, claim.mask) for target, claim in present]
    logits, passing = _contested(world, present)
    if strangers is not None and present:
        strange = cv2.resize(strangers, world.shape[::-1], interpolation=cv2.INTER_NEAREST)
        logits = [
            leave_to(strange, claim, logit, target.carried_template(claim.window))
            for (target, claim), logit in zip(present, logits, strict=True)
        ]
    for target, nothing in judged:
        if nothing is None and target.state == TRACKED:
            target.lose()
    for (target, claim), logit in zip(present, logits, strict=True):
        likelihood = likelihood_image(logit, claim.window, world.shape)
        likelihoods[target.track_id] = likelihood
        if target.state == TRACKED:
            cover = _cover(target, masks, claim.window)
            for outline in passing:
                part = outline.enlarged(claim.window)
                cover = part if cover is None else cv2.bitwise_or(cover, part)
            assess(target, likelihood, claim, cover)
    if any(target.state == LOST and target.lost_s > 0 for target in targets):
        _recover(world, targets, {t.track_id: claim for t, claim in present}, likelihoods)
    return likelihoods


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
    told: list[tuple[Target, Learnt]] = []
    for target in targets:
        if target.track_id not in record.bodies:
            continue
        feedback = by_track.get(target.track_id)
        alone = not any(target.meets(other) for other in targets if other is not target)
        learnt = teach(target, record, feedback, alone=alone)
        if learnt is None:
            people[target.person.area.slices(world.shape[1], world.shape[0])] = 255
        else:
            where, margin = learnt.margin
            people[where] |= margin
            told.append((target, learnt))
    if not config.use_background:
        return
    busy = None
    if told:
        around = [learnt.window for _, learnt in told]
        busy = world.learn(record, people, around, gate=config.use_motion_gate)
    _learn_passers_by(world, record, targets, told, people, busy, config)


def _contested(
    world: World, present: Sequence[tuple[Target, Claim]]
) -> tuple[list[NDArray[np.float32]], list[Outline]]:
    """Return the log ratios of people in competition, and what is seen of who passes by."""
    claims, others = [claim for _, claim in present], world.passers_by
    for target, claim in present:
        if others.known and target.person.learnt == 0:
            others.leave(placed(claim.mask, claim.window, world.shape))
    if not (others.known and claims):
        return compete(claims), []
    people, config = [target.person for target, _ in present], present[0][0].config
    passing = others.claims(world.now, world.pending, people, config)
    logits = compete([*claims, *passing.values()])
    others.note(world.now, passing, logits[len(claims) :], config.shadow_floor)
    return logits[: len(claims)], list(world.now.passers_by.values())


def _learn_passers_by(
    world: World,
    record: Record,
    targets: Sequence[Target],
    told: Sequence[tuple[Target, Learnt]],
    people: NDArray[np.uint8],
    busy: NDArray[np.uint8] | None,
    config: TrackingConfig,
) -> None:
    """Learn who else is about, away from the people who are tracked."""
    others = world.passers_by
    if not (told or others.known):
        return
    beside = Beside(record, people, busy)
    for _, learnt in told:
        beside.add(learnt.window, learnt.strange, learnt.mask, learnt.template)
    others.learn(beside, world.pending, [target.person for target in targets])
    if any(target.state == LOST for target in targets):
        # It may be them.
        return
    for target, learnt in told:
        neighbour = Neighbour(
            target.person,
            target.appearance,
            learnt.window,
            whole=learnt.share >= _WELL_SEEN and not learnt.lately_part,
            inside=target.person.share_inside(world.shape) >= _WELL_SEEN,
        )
        others.find(beside, neighbour, config)


def _cover(target: Target, masks: Sequence[Place], window: Window) -> NDArray[np.uint8] | None:
    """Return where in a window a person is hidden by those who stand nearer, None if nowhere."""
    cover = None
    for other, about, mask in masks:
        if not (other.state == TRACKED and other.feet > target.feet and other.meets(target)):
            continue
        shared = overlap(about, window)
        if shared is None:
            continue
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


def _recover(
    world: World,
    targets: Sequence[Target],
    claims: dict[int, Claim],
    likelihoods: Likelihoods,
) -> None:
    """Look for those who are lost, where nobody else is."""
    lost = [target for target in targets if target.state == LOST and target.lost_s > 0]
    taken = np.zeros(world.shape, np.uint8)
    for target in targets:
        if target.state == TRACKED:
            _take(taken, target, likelihoods[target.track_id])
    for target in lost:
        likelihood = likelihoods.get(target.track_id)
        found = recover(target, claims.get(target.track_id), likelihood, taken)
        if found is not None:
            world.passers_by.leave(placed(target.carried_mask(), target.window, world.shape))
            likelihoods[target.track_id] = found
            _take(taken, target, found)


def _take(taken: NDArray[np.uint8], target: Target, likelihood: NDArray[np.uint8]) -> None:
    """Mark the likely pixels where somebody is expected, in images of the working size."""
    likely = likelihood[target.window] > 127
    taken[target.window] |= np.where(likely, target.carried_mask(), 0)
