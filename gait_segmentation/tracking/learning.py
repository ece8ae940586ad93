# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One person taught by the masks that come back: colours, place, size, outline and look."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import BodyFrame
from gait_segmentation.images import (
    Bounds,
    Window,
    bounding_box,
    count_likely,
    distance_from,
    shrink,
)
from gait_segmentation.results import LOST, Feedback
from gait_segmentation.tracking.competition import REACH
from gait_segmentation.tracking.records import Record
from gait_segmentation.tracking.target import Target

Part = tuple[Window, NDArray[np.uint8]]
"""Rows and columns of an image, and (h, w) uint8 of these."""


def learn(
    target: Target, record: Record, feedback: Feedback | None, *, alone: bool = True
) -> tuple[Window, Part] | None:
    """
    Learn from the mask of a frame just taken out of the world, if one came back.

    Nothing is learnt of colours, size and look from a mask that shows only part of somebody who
    is not at the border, but the person is followed by that part.

    :param alone: whether nobody else who is tracked is near.
    :returns: the window about the person, and the mask with a margin, where the person may be, in
        the frame it belongs to; None if the mask says nothing.
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
    whole = person.shows_all(mask)
    if whole:
        person.take(mask, prior)
        body = None if feedback.body is None else feedback.body.scaled(world.scale)
        margin = _learn_all(target, record, window, body)
    else:
        target.skip(record)
        person.part = mask
        margin = _about_part(target, window, mask, prior)
    person.shift(dx, dy)
    return (window, margin) if whole or alone else None


def _learn_all(target: Target, record: Record, window: Window, body: BodyFrame | None) -> Part:
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
) -> Part:
    """
    Return where somebody half hidden may be: in this mask, the last whole one, the template.

    What the person uncovers meanwhile is learnt as background, or it would trail behind.
    """
    where = np.zeros(target.world.shape, np.uint8)
    about = target.person.mask[window] | mask[window]
    where[window] = about | cv2.inRange(template[window], 128, 255)
    return grown(where, target.person.height)


MARGIN = 0.02
"""How far a mask may be off, in body heights: so far about it no background is learnt."""


def working_masks(
    feedback: Feedback, shape: tuple[int, int]
) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Return mask (0/255) and template at working size, (h, w) uint8, for the tracker alone."""
    mask, prior = feedback.mask, feedback.shape_prior
    # They are kept, and who else has them may draw on them.
    if mask.shape == shape:
        mask = mask.copy()
    else:
        mask = np.asarray(cv2.threshold(shrink(mask, shape), 127, 255, cv2.THRESH_BINARY)[1])
    if prior.shape == shape:
        return mask, prior.copy()
    return mask, np.asarray(cv2.resize(prior, shape[::-1], interpolation=cv2.INTER_LINEAR))


def grown(mask: NDArray[np.uint8], height: float, bounds: Bounds | None = None) -> Part:
    """
    Return a mask with a margin, where the person may be: a window and what is in it.

    :param mask: (h, w) uint8.
    :param height: of the body in pixels.
    :param bounds: of the mask, if they are known.
    """
    size = 2 * max(1, round(MARGIN * height)) + 1
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    x, y, width, tall = bounding_box(mask) if bounds is None else bounds
    part = (
        slice(max(y - size, 0), min(y + tall + size, mask.shape[0])),
        slice(max(x - size, 0), min(x + width + size, mask.shape[1])),
    )
    return part, np.asarray(cv2.dilate(mask[part], kernel))


def without_parts_apart(
    mask: NDArray[np.uint8], template: NDArray[np.uint8] | None, height: float
) -> NDArray[np.uint8]:
    """
    Return a mask without the parts that lie mostly apart from the template, if any is near it.

    :param mask: (h, w) uint8 0/255; the same is returned if nothing goes.
    :param template: (h, w) uint8, above 127 on the body; None if that is not known.
    :param height: of the body in pixels.
    """
    if template is None or not count_likely(template):
        return mask
    body = np.asarray(cv2.threshold(template, 127, 255, cv2.THRESH_BINARY)[1])
    x, y, width, tall = bounding_box(mask | body)
    part = slice(y, y + tall), slice(x, x + width)
    count, parts = cv2.connectedComponents(np.ascontiguousarray(mask[part]), connectivity=4)
    if count <= 2:
        return mask
    away = distance_from(body[part] > 0)
    area = np.bincount(parts.ravel(), minlength=count)
    near = 2 * np.bincount(parts.ravel(), (away > REACH * height).ravel(), count) <= area
    near[0] = False
    if not near.any() or near[1:].all():
        return mask
    own = np.zeros_like(mask)
    own[part] = 255 * near[parts].astype(np.uint8)
    return own
