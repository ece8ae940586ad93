# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One person taught by the masks that come back: colours, place, size, outline and look."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import BodyFrame
from gait_segmentation.images import Window, bounding_box
from gait_segmentation.results import LOST, Feedback
from gait_segmentation.tracking.person.learning import (
    grown,
    without_parts_apart,
    working_masks,
)
from gait_segmentation.tracking.records import Record
from gait_segmentation.tracking.target import Target

__all__ = ['Learnt', 'learn']


@dataclass(frozen=True)
class Learnt:
    """
    What a mask that was learnt from told, in the frame it belongs to.

    ``window`` is about the person, ``margin`` a window and (h, w) uint8 of it, the mask with a
    margin: where the person may be.
    """

    window: Window
    margin: tuple[Window, NDArray[np.uint8]]


def learn(
    target: Target, record: Record, feedback: Feedback | None, *, alone: bool = True
) -> Learnt | None:
    """
    Learn from the mask of a frame just taken out of the world, if one came back.

    Nothing is learnt of colours, size and look from a mask that shows only part of somebody who
    is not at the border, but the person is followed by that part.

    :param alone: whether nobody else who is tracked is near.
    :returns: what it told; None if the mask says nothing.
    """
    person, world = target.person, target.world
    if feedback is None or target.state == LOST or not target.learns_from_masks:
        target.skip(record)
        return None
    mask, prior = working_masks(feedback, world.shape)
    if not person.teaches(mask, prior):
        target.skip(record)
        person.part = mask
        return None
    dx, dy = world.since_mask(target.track_id)
    person.shift(-dx, -dy)
    window = target.window
    whole = target.area.update(mask, person)
    if whole:
        person.take(mask, prior)
        body = None if feedback.body is None else feedback.body.scaled(world.scale)
        margin = _learn_all(target, record, window, body)
    else:
        target.skip(record)
        person.part = mask
        margin = _about_part(target, window, mask, prior)
    person.shift(dx, dy)
    if not (whole or alone):
        return None
    return Learnt(window, margin)


def _learn_all(
    target: Target,
    record: Record,
    window: Window,
    body: BodyFrame | None,
) -> tuple[Window, NDArray[np.uint8]]:
    """
    Learn from a mask of all of the person, just taken.

    :param body: the matched body in working pixels.
    :returns: the mask with a margin.
    """
    person, config = target.person, target.config
    mask, rates = person.mask, (config.person_colour_rate, config.colour_rate)
    for cue in person.cues:
        cue.learn(record, target.track_id, mask)
    lab = record.image.lab_part(window)
    strange = record.strange(window, config.shadow_floor)
    familiar = record.background.is_sure(window) & (strange == 0)
    person.learn_colours(lab, window, mask, person.template, rates, familiar)
    bounds = bounding_box(mask)
    margin = grown(mask, person.height, bounds)
    # A piece of the place that the first mask took along would pull the body to it.
    own = without_parts_apart(mask, person.template, person.height)
    own_bounds = bounds if own is mask else bounding_box(own)
    person.learn_place(own, body, own_bounds)
    if config.use_tilt:
        person.learn_angle(own, own_bounds)
    target.learn_look(record)
    return margin


def _about_part(
    target: Target, window: Window, mask: NDArray[np.uint8], template: NDArray[np.uint8]
) -> tuple[Window, NDArray[np.uint8]]:
    """
    Return where somebody half hidden may be: in this mask, the last whole one, the template.

    What the person uncovers meanwhile is learnt as background, or it would trail behind.
    """
    where = np.zeros(target.world.shape, np.uint8)
    about = target.person.mask[window] | mask[window]
    where[window] = about | cv2.inRange(template[window], 128, 255)
    return grown(where, target.person.height)
