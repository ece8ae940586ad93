# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
A person taught by a mask that came back: of whom it shows what.

Where it shows somebody else, too, they are taken out of it; where the masks have gone over to
somebody else, the person is looked for as they were before.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import shift_whole
from gait_segmentation.results import LOST, Feedback
from gait_segmentation.tracking.finding import recover
from gait_segmentation.tracking.learner import Learnt
from gait_segmentation.tracking.person.learning import working_masks
from gait_segmentation.tracking.records import Record
from gait_segmentation.tracking.target import Target

__all__ = ['teach']


def teach(
    target: Target, record: Record, feedback: Feedback | None, *, alone: bool = True
) -> Learnt | None:
    """
    Learn from the mask of a frame just taken out of the world, if one came back.

    :param alone: whether nobody else is near.
    :returns: what it told; None if the mask says nothing, or showed somebody else.
    """
    if feedback is None or target.state == LOST:
        target.skip(record)
        return None
    mask, prior = working_masks(feedback, target.world.shape)
    _part(target, record, mask)
    body = feedback.body
    learnt = target.learner.learn(record, mask, prior, body, target.config, alone=alone)
    if learnt is None or not alone or not _is_other(target, record, learnt):
        return learnt
    return None if _turn_back(target, record, learnt) else learnt


def _part(target: Target, record: Record, mask: NDArray[np.uint8]) -> None:
    """Take somebody else whom a mask of working size shows, too, out of it."""
    person, world = target.person, target.world
    since = world.since_mask(target.track_id)
    others = target.guard.others_in(person, target.memory, record, mask, since)
    if others is not None:
        mask[others > 0] = 0
        world.passers_by.leave(mask)
        world.passers_by.welcome(others, since, record, person, target.config)


def _is_other(target: Target, record: Record, learnt: Learnt) -> bool:
    """Return whether the body that is followed seems to be somebody else's."""
    return target.guard.is_other(
        target.person,
        target.memory,
        record,
        learnt.window,
        learnt.mask,
        target.world.since_mask(target.track_id),
        learnt.share,
        about=target.world.passers_by.walking,
    )


def _turn_back(target: Target, record: Record, learnt: Learnt) -> bool:
    """
    Look for the person elsewhere, as the person was before.

    :returns: whether the person was found; the body that was followed is then that of
        somebody without a slot.  Else all is as it was.
    """
    world = target.world
    since = world.since_mask(target.track_id)
    followed = target.snapshot()
    target.doubt()
    taken = shift_whole(learnt.mask, round(since[0]), round(since[1]))
    if recover(target, None, None, taken) is None:
        target.restore(followed)
        return False
    target.hide()
    world.passers_by.forget()
    world.passers_by.welcome(learnt.mask, since, record, followed.person.state, target.config)
    return True
