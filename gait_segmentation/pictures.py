# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The debug images of the nodes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.drawing import (
    draw_box,
    draw_label,
    draw_match,
    draw_outline,
    draw_person,
    track_colour,
)
from gait_segmentation.geometry import Box
from gait_segmentation.results import LOST

if TYPE_CHECKING:
    from gait_segmentation.results import MatchResult, TrackResult
    from gait_segmentation.segmentation import PeopleMasks

__all__ = ['matching_picture', 'segmentation_picture', 'tracking_picture']


def tracking_picture(image: NDArray[np.uint8], tracks: Sequence[TrackResult]) -> NDArray[np.uint8]:
    """Return a frame with the likelihoods in red, and boxes with the state of the tracks."""
    picture = image.copy()
    size = (image.shape[1], image.shape[0])
    for track in tracks:
        if track.box is None:
            continue
        red = cv2.resize(track.likelihood, size, interpolation=cv2.INTER_LINEAR)
        picture[:, :, 2] = np.maximum(picture[:, :, 2], red)
    lost = [track.track_id for track in tracks if track.state == LOST]
    for track in tracks:
        if track.box is None:
            continue
        colour = track_colour(track.track_id)
        draw_box(picture, track.box, colour)
        words = f'{track.track_id}  {100 * track.confidence:.0f} %'
        draw_label(picture, words, (track.box.x, track.box.y - 16), colour)
    for line, track_id in enumerate(lost):
        draw_label(picture, f'{track_id}  lost', (4, 4 + 18 * line), track_colour(track_id))
    return picture


def matching_picture(
    likelihoods: Sequence[NDArray[np.uint8]],
    matches: Sequence[MatchResult],
    tracks: Sequence[TrackResult] = (),
    source_width: int = 0,
) -> NDArray[np.uint8]:
    """
    Return the likelihoods with the outlines of the matched templates, at one size.

    :param tracks: of the same people; their boxes are then drawn in red, the refined in green.
    :param source_width: of the image that boxes are measured in; 0 = that of the picture.
    """
    shape = max((each.shape for each in likelihoods), key=lambda each: (each[0] * each[1], each))
    size = (shape[1], shape[0])
    joint = np.zeros(shape, np.uint8)
    for each in likelihoods:
        joint = np.maximum(joint, _resized(each, size))
    picture = np.asarray(cv2.cvtColor(joint, cv2.COLOR_GRAY2BGR))
    for match in matches:
        if match.body is not None:
            draw_outline(picture, _resized(match.shape_prior, size), track_colour(match.track_id))
    scale = size[0] / (source_width or size[0])
    for track, match in zip(tracks, matches, strict=bool(tracks)):
        if track.body is not None and match.body is not None:
            refined = None if match.box is None else match.box.scaled(scale)
            tracked = track.body.scaled(scale)
            draw_match(picture, tracked=tracked, angle=track.angle, refined=refined)
    return picture


def _resized(image: NDArray[np.uint8], size: tuple[int, int]) -> NDArray[np.uint8]:
    if image.shape[::-1] == size:
        return image
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_LINEAR))


def segmentation_picture(
    image: NDArray[np.uint8],
    masks: PeopleMasks,
    matches: Sequence[MatchResult],
    tracks: Sequence[TrackResult] = (),
) -> NDArray[np.uint8]:
    """
    Return a frame with silhouettes, templates, boxes and gait.

    :param tracks: of the same people, if they are known: their boxes are then drawn in red, and
        in place of the boxes about the masks the refined ones in green.
    """
    picture = image.copy()
    for place, (found, match) in enumerate(zip(masks.people, matches, strict=True)):
        box = Box.around(found.mask) if match.body is not None else None
        if box is None:
            continue
        track = tracks[place] if tracks else None
        if track is not None:
            box = match.box or box
        draw_person(
            picture,
            mask=found.mask,
            box=box,
            track_id=match.track_id,
            phase=match.phase,
            azimuth=match.azimuth,
        )
        draw_match(
            picture,
            tracked=None if track is None else track.body,
            angle=0.0 if track is None else track.angle,
            refined=None if track is None else match.box,
            template=match.shape_prior,
        )
    return picture
