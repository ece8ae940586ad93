# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Somebody lost found again: where expected, or else all over the image at low resolution."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.colour import body_rows
from gait_segmentation.images import bounding_box
from gait_segmentation.tracking.competition import REACH, Claim
from gait_segmentation.tracking.likelihood import likelihood_image, log_ratio
from gait_segmentation.tracking.person import LEAST_SEEN
from gait_segmentation.tracking.records import Shift
from gait_segmentation.tracking.target import Target
from gait_segmentation.tracking.visibility import ALONE, Sight

_FOUND_SHARE, _FOUND_INSIDE, _FOUND_CONTRAST = 0.12, 0.5, 0.35
"""
What somebody lost must show to be found: uncovered share, likelihood, and contrast.  The first is
what a search must score, too, since what is hidden adds nothing.
"""

_SEARCH_HEIGHT = 32
"""Height of the body in the image that is searched, in pixels."""

_FAR_COST = 0.08
"""What a body height away from the expected place costs."""


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
    if claim is not None and likelihood is not None and _shows(target, claim, likelihood, taken):
        return likelihood
    found = _search(target, taken)
    if found is None:
        return None
    dx, dy = found
    target.shift_now(dx, dy)
    claim = target.judge()
    if claim is not None:
        likelihood = likelihood_image(claim.logit, claim.window, target.world.shape)
        likelihood[taken > 0] = 0
        if _shows(target, claim, likelihood, taken):
            # Who is not where the pace led does not walk at it.
            target.person.forget_pace()
            return likelihood
    target.shift_now(-dx, -dy)
    return None


def _shows(
    target: Target, claim: Claim, likelihood: NDArray[np.uint8], taken: NDArray[np.uint8]
) -> bool:
    """
    Return whether the person, and nobody else, can be seen at the place; then track them there.

    If not, nothing but the confidence changes.
    """
    now, shape = target.world.now, target.world.shape
    if target.person.share_inside(shape) < LEAST_SEEN:
        return False
    window = claim.window
    values, rivals = likelihood[window], taken[window]
    sight = Sight.of(values, claim.mask, rivals, rivals)
    target.confidence = sight.confidence
    # Who is not behind others may be beside or above something that stands there.
    strange = now.strange(window, target.config.shadow_floor)
    before = sight.share > ALONE and _stands_out(sight.before(strange, values))
    if not (before or _stands_out(sight)):
        return False
    likely = np.zeros(shape, np.uint8)
    likely[window] = np.where(values > 127, sight.uncovered, 0)
    if not target.appearance.is_like(target.look(likely, now)):
        return False
    target.regain(values, sight, claim)
    return True


def _stands_out(sight: Sight) -> bool:
    """Return whether enough is seen, likely, and more so than what is around."""
    contrast = sight.inside - sight.outside
    return (
        sight.share >= _FOUND_SHARE
        and sight.inside >= _FOUND_INSIDE
        and contrast >= _FOUND_CONTRAST
    )


def _search(target: Target, taken: NDArray[np.uint8]) -> Shift | None:
    """
    Look for the last silhouette of all of the person all over the newest frame.

    :returns: how far from the expected place the person seems to be, in pixels, if anywhere.
    """
    person, record = target.person, target.world.now
    step = max(1, round(person.height / _SEARCH_HEIGHT))
    every = slice(None, None, step), slice(None, None, step)
    lab = record.image.lab_part(every)
    shape, height = (lab.shape[0], lab.shape[1]), person.height / step
    center_x, center_y = person.center_x / step, person.center_y / step
    logit = log_ratio(
        lab,
        body_rows(shape, (0, 0), (center_x, center_y), height),
        every,
        record.background,
        person.person,
        person.surroundings,
        target.config,
    )
    likelihood = likelihood_image(logit, (slice(None), slice(None)), shape)
    likelihood[taken[every] > 0] = 0
    whole, then = target.whole
    left, top, across, down = bounding_box(whole)
    mask = np.ascontiguousarray(whole[top : top + down : step, left : left + across : step])
    x = center_x + (left - then[0] + across / 2) / step
    y = center_y + (top - then[1] + down / 2) / step
    found = find_silhouette(likelihood, mask, (x, y), height)
    if found is None or found[2] < _FOUND_SHARE:
        return None
    return step * (found[0] - x), step * (found[1] - y)


def find_silhouette(
    likelihood: NDArray[np.uint8],
    mask: NDArray[np.uint8],
    place: tuple[float, float],
    height: float,
) -> tuple[float, float, float] | None:
    """
    Find where a silhouette fits a likelihood best.

    :param likelihood: (h, w) uint8.
    :param mask: (H, W) uint8, the silhouette as it was last, cut out.
    :param place: (x, y) where the middle of the cut-out is expected.
    :param height: of the body, in pixels.
    :returns: (x, y) of the middle and the score: mean likelihood inside minus that in a ring
        about the silhouette (-1..1), less what the distance costs; None without a silhouette.
    """
    if not (mask > 127).any():
        return None
    margin = max(1, round(REACH * height))
    inside = np.pad((mask > 127).astype(np.float32), margin)
    size = 2 * margin + 1
    ring = cv2.dilate(inside, np.ones((size, size), np.uint8)) - inside
    kernel = inside / inside.sum() - ring / max(float(ring.sum()), 1.0)
    score = cv2.filter2D(
        likelihood, cv2.CV_32F, kernel / np.float32(255), borderType=cv2.BORDER_CONSTANT
    )
    # An odd kernel is centred on a pixel, an even one half a pixel before its middle.
    off_x, off_y = (0.5 if side % 2 else 0.0 for side in inside.shape[::-1])
    away_x = np.abs(np.arange(score.shape[1], dtype=np.float32) + np.float32(off_x - place[0]))
    away_y = np.abs(np.arange(score.shape[0], dtype=np.float32) + np.float32(off_y - place[1]))
    score -= np.float32(_FAR_COST / height) * (away_x[None, :] + away_y[:, None])
    row, column = divmod(int(score.argmax()), score.shape[1])
    return column + off_x, row + off_y, float(score[row, column])
