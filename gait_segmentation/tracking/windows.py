# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The parts of an image in which the background about people is known and learnt."""

from __future__ import annotations

from collections.abc import Iterable

from gait_segmentation.ego_motion.world_motion import WorldMotion
from gait_segmentation.geometry import Box, body_window
from gait_segmentation.images import Window

__all__ = ['windows_about']

_AHEAD = 0.1
"""
How far beyond where pixels are judged the background is followed, in body heights, so that it is
known before the person comes there.
"""


def windows_about(
    areas: Iterable[Box], motion: WorldMotion, shape: tuple[int, int]
) -> list[Window]:
    """
    Return disjoint windows with room about people, as the camera moved them.

    :param areas: where people were in the last frame, in pixels.
    :param motion: of the world since.
    :param shape: (h, w) of the image; all of it is the window if there are no people.
    """
    height, width = shape
    boxes: list[Box] = []
    for area in areas:
        x, y = motion.carry(area.center_x, area.center_y)
        ahead = _AHEAD * area.height
        box = body_window(x, y, area.height).padded(ahead, ahead)
        while touching := [other for other in boxes if other.iou(box) > 0]:
            boxes = [other for other in boxes if other not in touching]
            for other in touching:
                box = box.union(other)
        boxes.append(box)
    if not boxes:
        return [(slice(0, height), slice(0, width))]
    windows = (box.slices(width, height) for box in boxes)
    return [w for w in windows if w[0].start < w[0].stop and w[1].start < w[1].stop]
