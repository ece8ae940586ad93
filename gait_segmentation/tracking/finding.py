# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Somebody lost found again: where expected, or else all over the image."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.tracking.competition import Claim
from gait_segmentation.tracking.likelihood.log_ratio import likelihood_image
from gait_segmentation.tracking.person.person import LEAST_SEEN
from gait_segmentation.tracking.recovery.visibility import ALONE, Sight
from gait_segmentation.tracking.target import Target

__all__ = ['recover']


def recover(
    target: Target,
    claim: Claim | None,
    likelihood: NDArray[np.uint8] | None,
    taken: NDArray[np.uint8],
) -> NDArray[np.uint8] | None:
    """
    Look for the person who is lost: where expected, then all over the image.

    :param claim: what was judged where the person is expected, None if nothing was.
    :param likelihood: (h, w) uint8 of that after competing with others, None likewise.
    :param taken: (h, w) uint8, non-zero where others are.
    :returns: the likelihood, (h, w) uint8, if the person was found; the state is then tracked.
        Else None, and the person is where expected; only the confidence tells what was seen.
    """
    person, world = target.person, target.world
    if claim is not None and likelihood is not None and _shows(target, claim, likelihood, taken):
        return likelihood
    found = target.memory.search(person, world, taken, target.config)
    if found is None:
        return None
    dx, dy, partly = found
    target.shift_now(dx, dy)
    claim = target.judge()
    if claim is not None:
        likelihood = likelihood_image(claim.logit, claim.window, world.shape)
        likelihood[taken > 0] = 0
        if _shows(target, claim, likelihood, taken, partly=partly):
            return likelihood
    target.shift_now(-dx, -dy)
    return None


def _shows(
    target: Target,
    claim: Claim,
    likelihood: NDArray[np.uint8],
    taken: NDArray[np.uint8],
    *,
    partly: bool = False,
) -> bool:
    """
    Return whether the person, and nobody else, can be seen at the place; then track them there.

    If not, nothing but the confidence changes.

    :param partly: whether only what stands out before the known background counts.
    """
    person, world = target.person, target.world
    if person.share_inside(world.shape) < LEAST_SEEN:
        return False
    window = claim.window
    values, rivals = likelihood[window], taken[window]
    sight = Sight.of(values, claim.mask, rivals, rivals)
    target.confidence = sight.confidence
    likely = np.zeros(world.shape, np.uint8)
    likely[window] = np.where(values > 127, sight.uncovered, 0)
    part = None
    if sight.share > ALONE:
        part = sight.before(world.now.strange(window, target.config.shadow_floor), values)
    if not target.memory.is_found(person, sight, part, likely, world.now, partly=partly):
        return False
    target.regain(values, sight, claim)
    return True
