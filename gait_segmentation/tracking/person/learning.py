# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What of a mask that came back is fit to be learnt from."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import scaling
from gait_segmentation.images import Bounds, Window, bounding_box, count_likely
from gait_segmentation.kernels import kernel
from gait_segmentation.results import Feedback
from gait_segmentation.sizes import shrink
from gait_segmentation.tracking.person.person import Person
from gait_segmentation.warping import warp_window

__all__ = ['WholeArea', 'grown', 'without_world', 'working_masks']

_STAYS, _OUTSIDE = -0.5, 0.06
_MOVES, _FAR_OUTSIDE = 0.5, 0.1
"""
Evidence from motion up to which a pixel is the world's if it lies that far (in body heights)
outside of the template: what stays, and farther out whatever is not seen to move along, as a
shadow on a bare wall.
"""

_ABOUT_MASK = 3
"""Pixels about a mask that are empty, so that it does not go on beyond them."""

_MARGIN = 0.02
"""Margin about the mask that is not learnt as background, in body heights."""

_WHOLE = 0.75
"""Share of the usual area from which a mask shows all of the person."""

_JOINED, _LATE_RATE = 1.3, 0.3
"""
Area over that of late from which a mask shows somebody else, too, who is near; and the rate at
which that of late is learnt while nobody is.
"""

_AREA_RATE, _CORRECTION_RATE = 0.03, 0.2
"""Share by which the usual area moves towards that of a mask, and while it proves too large."""

_HIDDEN_FOR = 15
"""Masks after somebody was hidden from which nothing is learnt unless they are whole."""

_UNSURE = 30
"""Masks in which the usual area may still be that of a first mask that was far too large."""


def working_masks(
    feedback: Feedback, shape: tuple[int, int]
) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Return mask (0/255) and template at working size, (h, w) uint8, for the tracker alone."""
    mask, prior = feedback.mask, feedback.shape_prior
    # They are kept, and who else has them may draw on them.
    mask = mask.copy() if mask.shape == shape else _shrunk(mask, shape)
    if prior.shape == shape:
        return mask, prior.copy()
    return mask, np.asarray(cv2.resize(prior, shape[::-1], interpolation=cv2.INTER_LINEAR))


def _shrunk(mask: NDArray[np.uint8], shape: tuple[int, int]) -> NDArray[np.uint8]:
    """Return a mask (0/255) at a smaller size; only the part about it is looked at."""
    small = np.zeros(shape, np.uint8)
    x, y, width, height = bounding_box(mask)
    if width == 0:
        return small
    step = 1
    while mask.shape[0] // step >= 2 * shape[0] and mask.shape[1] // step >= 2 * shape[1]:
        step *= 2
    # Halved as often as that leaves it large enough: rows and columns then, with some to spare.
    rows = _thinned(y, height, step, mask.shape[0])
    columns = _thinned(x, width, step, mask.shape[1])
    part = mask[step * rows.start : step * rows.stop, step * columns.start : step * columns.stop]
    part = shrink(part, (rows.stop - rows.start, columns.stop - columns.start))
    x, y, width, height = bounding_box(part)
    x, y = x + columns.start, y + rows.start
    fall, across = shape[0] / (mask.shape[0] // step), shape[1] / (mask.shape[1] // step)
    window = (
        slice(max(int(fall * y) - 1, 0), min(int(fall * (y + height)) + 2, shape[0])),
        slice(max(int(across * x) - 1, 0), min(int(across * (x + width)) + 2, shape[1])),
    )
    motion = scaling(across, fall)
    motion[:, 2] = across * columns.start, fall * rows.start
    part = warp_window(np.ascontiguousarray(part), motion, window)
    small[window] = cv2.threshold(part, 127, 255, cv2.THRESH_BINARY)[1]
    return small


def _thinned(start: int, length: int, step: int, size: int) -> slice:
    """Return a part of a line with a margin, of which but every ``step``-th pixel is left."""
    low, high = start // step, -(-(start + length) // step)
    return slice(max(low - _ABOUT_MASK, 0), min(high + _ABOUT_MASK, size // step))


def without_world(
    mask: NDArray[np.uint8],
    prior: NDArray[np.uint8],
    moving: tuple[Window, NDArray[np.float32]] | None,
    height: float,
    *,
    settled: bool,
) -> None:
    """
    Take out of a mask what is outside of the template and does not move with the body.

    :param mask, prior: (h, w) uint8, the mask 0/255, changed, and the template.
    :param moving: a window and the evidence (-2..2) that its pixels move with the body; None if
        that is not known.
    :param height: of the body in pixels.
    :param settled: whether the template is past its first errors; if not, only what is seen to
        stay is taken out.
    """
    if moving is None:
        return
    (rows, columns), evidence = moving
    # Only the part about the mask is touched.
    x, y, width, tall = bounding_box(mask[rows, columns])
    about_mask = mask[rows, columns][y : y + tall, x : x + width]
    part = np.ascontiguousarray(about_mask)
    evidence = np.ascontiguousarray(evidence[y : y + tall, x : x + width])
    rules = [(_STAYS, _OUTSIDE), (_MOVES, _FAR_OUTSIDE)]
    for most, distance in rules if settled else rules[:1]:
        reach = max(1, round(distance * height))
        top, left = max(y - reach, 0), max(x - reach, 0)
        about = prior[rows, columns][top : y + tall + reach, left : x + width + reach]
        near = cv2.dilate(about, np.ones((2 * reach + 1, 2 * reach + 1), np.uint8))
        near = near[y - top : y - top + tall, x - left : x - left + width]
        _clear(part, np.ascontiguousarray(near), evidence, most)
    about_mask[:] = part


@kernel('u1[:,::1], u1[:,::1], f4[:,::1], f8')
def _clear(
    mask: NDArray[np.uint8], near: NDArray[np.uint8], evidence: NDArray[np.float32], most: float
) -> None:
    """Take out of a mask what is not near and has little evidence."""
    least = np.float32(most)
    for row in range(mask.shape[0]):
        for col in range(mask.shape[1]):
            if near[row, col] <= 127 and evidence[row, col] < least:
                mask[row, col] = 0


def grown(
    mask: NDArray[np.uint8], height: float, bounds: Bounds | None = None
) -> tuple[Window, NDArray[np.uint8]]:
    """
    Return a mask with a margin, where the person may be: a window and what is in it.

    :param mask: (h, w) uint8.
    :param height: of the body in pixels.
    :param bounds: of the mask, if they are known.
    """
    size = 2 * max(1, round(_MARGIN * height)) + 1
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    x, y, width, tall = bounding_box(mask) if bounds is None else bounds
    part = (
        slice(max(y - size, 0), min(y + tall + size, mask.shape[0])),
        slice(max(x - size, 0), min(x + width + size, mask.shape[1])),
    )
    return part, np.asarray(cv2.dilate(mask[part], kernel))


class WholeArea:
    """
    How large the masks of a person usually are, for the height.

    The first mask may have been far too large: then nothing would be learnt, and the track be
    lost.  So at first a mask is also whole if it is as large as the template.

    ``share`` is the area of the last mask over what was usual then.
    """

    def __init__(self, person: Person) -> None:
        """Begin with the person's mask."""
        self._usual = self._late = _area(person.mask, person)
        self._masks = 0
        self._hidden = 0
        self.share = 1.0

    @property
    def settled(self) -> bool:
        """Return whether the first, unsure masks are over."""
        return self._masks > _UNSURE

    def hide(self) -> None:
        """Take the next masks for those of somebody hidden in part, until one is whole."""
        self._hidden = _HIDDEN_FOR

    def update(
        self,
        mask: NDArray[np.uint8],
        prior: NDArray[np.uint8],
        person: Person,
        *,
        alone: bool = True,
        company: bool = False,
        hidden: Callable[[], bool] = lambda: False,
    ) -> bool:
        """
        Get used to the size of a mask, unless the person is or was just now hidden in part.

        :param mask, prior: (h, w) uint8, the mask and the template.
        :param alone: whether nobody who is tracked is near, who may hide part of the person, to
            which the template would adapt, or lose theirs to the mask.
        :param company: whether somebody without a slot is near, whom the mask may show, too.
        :param hidden: tells whether the template lies on what is known to stand there; only
            asked of masks that are not large enough.
        :returns: whether it was as large as usual; else it shows only part of the person, or
            somebody else, too.
        """
        area, rate = _area(mask, person), _AREA_RATE
        self.share = area / max(self._usual, 1e-6)
        whole = area >= _WHOLE * self._usual
        self._masks += 1
        if alone and not company:
            self._late += _LATE_RATE * (area - self._late)
        elif area > _JOINED * max(self._usual, self._late):
            return False
        if whole:
            self._hidden = 0
        elif hidden():
            self.hide()
        elif self._hidden:
            self._hidden -= 1
        if self._hidden:
            return False
        if alone and not whole and self._masks <= _UNSURE:
            template = _area(prior, person)
            whole = template > 0 and area >= _WHOLE * template
            rate = _CORRECTION_RATE if whole else rate
        self._usual += rate * (area - self._usual)
        return whole


def _area(mask: NDArray[np.uint8], person: Person) -> float:
    """Return the area of a mask in squared body heights, made up for what is outside."""
    inside = max(person.share_inside(mask.shape), 0.1)
    return count_likely(mask) / (inside * person.height**2)
