# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far what is in an outline went from one frame to the next, by comparing its pixels."""

from __future__ import annotations

import cv2

from gait_segmentation.ego_motion.pyramid import Pyramid
from gait_segmentation.tracking.outline import Outline

__all__ = ['matched_shift']


def matched_shift(
    last: Pyramid,
    now: Pyramid,
    outline: Outline,
    guess: tuple[float, float],
    reach: float,
) -> tuple[float, float]:
    """
    Return the shift (dx, dy) that makes what is in an outline look most alike in two frames.

    :param last: the frame of the outline, and ``now`` the one after it.
    :param guess: about where the shift is sought, in pixels of the working image.
    :param reach: how far from there, in the same pixels.
    :returns: a shift by an even number of pixels; the guess if all of it is outside of the image.
    """
    before, after = last.image(1), now.image(1)
    part = outline.about(0, before.shape)
    rows, columns = part
    if rows.start >= rows.stop or columns.start >= columns.stop:
        return guess
    x, y, side = round(guess[0] / 2), round(guess[1] / 2), max(1, round(reach / 2))
    margin = side + max(abs(x), abs(y))
    room = cv2.copyMakeBorder(after, margin, margin, margin, margin, cv2.BORDER_REPLICATE)
    top, left = rows.start + margin + y - side, columns.start + margin + x - side
    room = room[
        top : top + rows.stop - rows.start + 2 * side,
        left : left + columns.stop - columns.start + 2 * side,
    ]
    unlike = cv2.matchTemplate(room, before[part], cv2.TM_SQDIFF, mask=outline.seen_in(part))
    row, column = divmod(int(unlike.argmin()), unlike.shape[1])
    return 2.0 * (x + column - side), 2.0 * (y + row - side)
