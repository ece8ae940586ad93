# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The debug images of the nodes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.drawing import draw_match, draw_person
from gait_segmentation.geometry import Box

if TYPE_CHECKING:
    from gait_segmentation.results import MatchResult, TrackResult
    from gait_segmentation.segmentation import PeopleMasks


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
