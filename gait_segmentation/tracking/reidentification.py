# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Re-identification of a lost person: where expected, else all over the image, made small, or by
whoever sees people.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from operator import itemgetter

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.colour import body_rows
from gait_segmentation.geometry import REACH, Box
from gait_segmentation.images import bounding_box, placed
from gait_segmentation.scene.scene import Shift, View
from gait_segmentation.starting import FirstMask
from gait_segmentation.tracking.appearance import SAME_COLOURS, SURELY_SAME
from gait_segmentation.tracking.likelihood import likelihood_image, place_shown
from gait_segmentation.tracking.pixels import ALONE, LEAST_SEEN, PixelClaim, Visibility
from gait_segmentation.tracking.state import Silhouette
from gait_segmentation.tracking.track import Track

_FOUND_SHARE, _FOUND_INSIDE, _FOUND_CONTRAST = 0.12, 0.5, 0.35
"""
What a lost person must show to be found: unoccluded share, likelihood, and contrast.  The first is
what a search must score, too, since what is hidden adds nothing.
"""

_SEARCH_HEIGHT = 32
"""Height of the body in the image that is searched, in pixels."""

_FAR_COST = 0.08
"""What a body height away from the expected place costs."""

_AT_PLACE, _AT_REACH = 0.1, 0.2
"""
How much less alike a lost person may look where they are expected, and how much more they have to
as far as they can be: in a crowd many look alike.
"""

_MOST_GROWN = 0.4
"""
The most by which the height of a lost person, as a logarithm, may be another at once, and by which
more in each second.
"""


def reacquire(
    track: Track,
    claim: PixelClaim | None,
    likelihood: NDArray[np.uint8] | None,
    taken: NDArray[np.uint8],
) -> NDArray[np.uint8] | None:
    """
    Look for the person who is lost: where expected, then all over the image.

    :param claim: where the person is expected, None if that is outside.
    :param likelihood: (h, w) uint8 of that after association, None likewise.
    :param taken: (h, w) uint8, non-zero where others are.
    :returns: the likelihood, (h, w) uint8, None if the person was not found.
    """
    if claim is not None and likelihood is not None and _shows(track, claim, likelihood, taken):
        return likelihood
    shift = None if track.full is None else _search(track, track.full, taken)
    if shift is None:
        return None
    dx, dy = shift
    track.shift(dx, dy)
    claim = track.claim()
    if claim is not None:
        likelihood = likelihood_image(claim.logit, claim.window, track.view.shape)
        likelihood[taken > 0] = 0
        if _shows(track, claim, likelihood, taken):
            # Who is not where the pace led does not walk at it.
            track.stop()
            return likelihood
    track.shift(-dx, -dy)
    return None


def _shows(
    track: Track, claim: PixelClaim, likelihood: NDArray[np.uint8], taken: NDArray[np.uint8]
) -> bool:
    """Return whether the person, and no one else, can be seen at the place; then track them."""
    shape = track.view.shape
    if track.pose.share_inside(shape) < LEAST_SEEN:
        return False
    window = claim.window
    values, rivals = likelihood[window], taken[window]
    visibility = Visibility.of(values, claim.mask, rivals, rivals)
    track.rate(visibility)
    # Who is not behind others may be beside or above something that stands there.
    lab, config = track.view.now.image.lab_part(window), track.config
    place = place_shown(track.view.background, lab, window, config)
    foreground = place.contradicted(lab, config.shadow_floor)
    visible = [visibility]
    if visibility.share > ALONE:
        visible.append(visibility.where(foreground > 0, values))
    if not any(
        part.share >= _FOUND_SHARE
        and part.inside >= _FOUND_INSIDE
        and part.contrast >= _FOUND_CONTRAST
        for part in visible
    ):
        return False
    likely = np.where(values > 127, visibility.unoccluded, np.uint8(0))
    if not track.looks_alike(placed(likely, window, shape)):
        return False
    track.find(values, visibility, claim)
    return True


def _search(track: Track, last: Silhouette, taken: NDArray[np.uint8]) -> Shift | None:
    """
    Look for the last silhouette of all of a person in the newest frame, within their reach.

    :returns: how far from the expected place the person seems to be, in pixels, if anywhere.
    """
    pose, view = track.pose, track.view
    (full, then), now = last, track.displacement
    if not full.any():
        return None
    body = Box(*bounding_box(full))
    there = body.shifted(now[0] - then[0], now[1] - then[1])
    margin = (track.reach + REACH) * pose.height
    rows, columns = there.padded(margin, margin).slices(view.shape[1], view.shape[0])
    step = max(1, round(pose.height / _SEARCH_HEIGHT))
    every = slice(rows.start, rows.stop, step), slice(columns.start, columns.stop, step)
    lab, height = view.now.image.lab_part(every), pose.height / step
    if not lab.size:
        return None
    shape, (left, top) = (lab.shape[0], lab.shape[1]), (columns.start, rows.start)
    center = (pose.center_x - left) / step, (pose.center_y - top) / step
    logit = track.log_ratio(lab, body_rows(shape, (0, 0), center, height), every)
    likelihood = likelihood_image(logit, (slice(None), slice(None)), shape)
    likelihood[taken[every] > 0] = 0
    mask = np.ascontiguousarray(full[body.slices(*full.shape[::-1])][::step, ::step])
    x, y = (there.center_x - left) / step, (there.center_y - top) / step
    found = find_silhouette(likelihood, mask, (x, y), height, track.reach)
    if found is None or found[2] < _FOUND_SHARE:
        return None
    return step * (found[0] - x), step * (found[1] - y)


def find_silhouette(
    likelihood: NDArray[np.uint8],
    mask: NDArray[np.uint8],
    place: tuple[float, float],
    height: float,
    reach: float,
) -> tuple[float, float, float] | None:
    """
    Find where a silhouette fits a likelihood best.

    :param likelihood: (h, w) uint8.
    :param mask: (H, W) uint8, the silhouette as it was last, cut out.
    :param place: (x, y) where the middle of the cut-out is expected.
    :param height: of the body, in pixels.
    :param reach: how far from there it may be, in body heights.
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
    score[np.hypot(away_x[None, :], away_y[:, None]) > reach * height] = -np.inf
    row, column = divmod(int(score.argmax()), score.shape[1])
    return column + off_x, row + off_y, float(score[row, column])


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


def found_in(lost: Track, others: Sequence[Track]) -> Track | None:
    """
    Return who of those who are tracked without a slot is the one who is lost, if any.

    Somebody who passes may take along the track of a person, who is then begun anew.  Who was
    found while the one who is lost looked as usual is somebody else.
    """
    alike = [
        (lost.likeness(other), other)
        for other in others
        if other.view is lost.view
        and other.existence.found_ns >= lost.usual_ns
        and _may_be_of(other.body.height, lost)
    ]
    likeness, found = max(alike, key=itemgetter(0), default=(0.0, None))
    return found if likeness >= SURELY_SAME else None


def _may_be_of(height: float, lost: Track) -> bool:
    """Return whether a lost person may be of a height by now, in source pixels."""
    return abs(math.log(height / lost.body.height)) <= _MOST_GROWN * (1 + lost.lost_s)


def _by_place(place: Box, lost: Track) -> float:
    """Return how much less alike a lost person may look in a place, below 0: has to look more."""
    if not _may_be_of(place.height, lost):
        return -math.inf
    last = lost.body
    away = math.hypot(place.center_x - last.center_x, place.center_y - last.center_y)
    heights = away / last.height
    if heights <= lost.reach:
        return _AT_PLACE - heights / lost.reach * (_AT_PLACE + _AT_REACH)
    # Who was not lost, but drawn away by something else, may be anywhere.
    return -_AT_REACH - _FAR_COST * (heights - lost.reach)
