# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a likelihood image shows of a person: how much, and where."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import Box
from gait_segmentation.images import Window, inner_range

GUARD = 0.05
"""How far outside of the last mask or the template pixels are the person's, in body heights."""

LEAST_SEEN = 0.25
"""Share of a person below which nothing is known: neither learnt nor followed."""

OUTERMOST = 0.005
"""Share of the pixels on each side that does not count where a person is measured."""

ALONE = 0.9
"""Share that must not be hidden by others, so that what hides the rest is the background."""


@dataclass(frozen=True)
class Visibility:
    """
    What of a person can be seen where the person is expected.

    ``unoccluded`` is (h, w) uint8 0/255, the expected mask without what others hide, and
    ``share`` its share of that mask.  ``inside`` and ``outside`` are the mean likelihoods (0..1)
    in what is unoccluded and around the person.
    """

    unoccluded: NDArray[np.uint8]
    share: float
    inside: float
    outside: float

    @classmethod
    def of(
        cls,
        values: NDArray[np.uint8],
        expected: NDArray[np.uint8],
        occluder: NDArray[np.uint8] | None,
        apart: NDArray[np.uint8] | None = None,
    ) -> Visibility:
        """
        Measure a window.

        :param values: (h, w) uint8 likelihood.
        :param expected: (h, w) uint8 0/255, where the person is expected.
        :param occluder: non-zero where others hide the person, None if nowhere.
        :param apart: non-zero where it is neither the person nor around, None if nowhere.
        """
        person = expected if apart is None else expected | apart
        outside = cv2.mean(values, ~person)[0] / 255
        whole = cls(expected, 1.0, cv2.mean(values, expected)[0] / 255, outside)
        return whole if occluder is None else whole.where(occluder == 0, values)

    def where(self, visible: NDArray[np.bool_], values: NDArray[np.uint8]) -> Visibility:
        """
        Return the visibility of what can be seen in part of the window only.

        :param values: (h, w) uint8 likelihood.
        """
        unoccluded = np.where(visible, self.unoccluded, np.uint8(0))
        share = cv2.countNonZero(unoccluded) / max(cv2.countNonZero(self.unoccluded), 1)
        inside = cv2.mean(values, unoccluded)[0] / 255
        return Visibility(unoccluded, self.share * share, inside, self.outside)

    @property
    def seen(self) -> float:
        """Return the share of the person that can be seen."""
        return self.share * self.inside

    @property
    def contrast(self) -> float:
        """Return how much likelier the person is than what is around."""
        return self.inside - self.outside

    @property
    def confidence(self) -> float:
        """Return how well the person stands out, of which what is hidden takes its share."""
        return self.share * max(0.0, self.contrast)


def visible_box(
    values: NDArray[np.uint8],
    mask: NDArray[np.uint8],
    away: NDArray[np.float32],
    window: Window,
    height: float,
) -> Box | None:
    """
    Return the tight box of the likely pixels near a mask, None if they are few.

    :param values: (h, w) uint8 likelihood of the window.
    :param mask: (h, w) uint8 0/255, what of the person is not hidden.
    :param away: (h, w) float32, how far beside the person expected pixels are.
    :param height: of the body in pixels.
    """
    likely = ((values > 127) & (away <= max(1.0, GUARD * height))).view(np.uint8)
    if cv2.countNonZero(likely) < max(1.0, LEAST_SEEN * cv2.countNonZero(mask)):
        return None
    (top, bottom), (left, right) = (
        inner_range(cv2.reduce(likely, axis, cv2.REDUCE_SUM, dtype=cv2.CV_32S), OUTERMOST)
        for axis in (1, 0)
    )
    return Box(window[1].start + left, window[0].start + top, right - left, bottom - top)
