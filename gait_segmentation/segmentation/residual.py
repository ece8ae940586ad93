# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The person's own shape: what masks have beyond templates, in the frame of the body, by phase.

Rucksack, dress and coat appear in it that no template has.  It is half the mean mask, which keeps
the person from going where a wrong template stands, and half the template of the frame with the
mean difference of masks from templates, in which arms and legs are not smeared.  It is used only
after some masks, and blended with the template, because switched on too early or too strongly it
locks errors in.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import BodyFrame, invert, pixel_affine, template_to_image

__all__ = ['PersonalShape']

_GRID = (64, 48)
_FILL = 0.8
_BINS = 20
_PHASE_DECAY = 0.97
_ALL_DECAY = 0.95
_TRUST_AT = 2.0
_LEAST_MASKS = 5

_FOLLOWS = 0.5
"""How much the person's own shape follows the template of the frame."""


class PersonalShape:
    """Mean shape of one person, overall and by gait phase, on a small grid in the body frame."""

    def __init__(self) -> None:
        """Start without knowing the person."""
        self.reset()

    def reset(self) -> None:
        """Forget the person."""
        self._by_phase = np.zeros((_BINS, *_GRID), np.float32)
        self._weight = np.zeros(_BINS, np.float32)
        self._all = np.zeros(_GRID, np.float32)
        self._all_weight = 0.0
        self._masks = 0

    @property
    def ready(self) -> bool:
        """Return whether enough masks were seen."""
        return self._masks >= _LEAST_MASKS

    def learn(
        self,
        mask: NDArray[np.uint8],
        template: NDArray[np.uint8],
        likely: NDArray[np.bool_],
        body: BodyFrame,
        phase: float,
    ) -> None:
        """
        Take in a mask as far as the pixels themselves show it.

        What is in the mask and not likely, or the other way round, is there because of the shape
        prior: learning it would only confirm what was learnt before.  There the template stands.

        :param mask: (h, w) uint8 0/255.
        :param template: (h, w) uint8, the template of its frame.
        :param likely: (h, w) bool, where the person is likely without the shape prior.
        :param body: the body in the mask's pixels.
        :param phase: gait phase in [0, 1).
        """
        shown = template.copy()
        cv2.copyTo(mask, (likely == (mask > 127)).view(np.uint8), shown)
        to_grid = pixel_affine(invert(template_to_image(body, *_GRID, _FILL)))
        small, expected = (
            cv2.warpAffine(each, to_grid, _GRID[::-1], flags=cv2.INTER_LINEAR).astype(np.float32)
            for each in (shown, template)
        )
        small = (small - _FOLLOWS * expected) / 255
        kernel = _phase_kernel(phase)
        self._by_phase *= _PHASE_DECAY
        self._weight *= _PHASE_DECAY
        self._by_phase += kernel[:, None, None] * small
        self._weight += kernel
        self._all = _ALL_DECAY * self._all + small
        self._all_weight = _ALL_DECAY * self._all_weight + 1
        self._masks += 1

    def probability(
        self, template: NDArray[np.uint8], body: BodyFrame, phase: float
    ) -> NDArray[np.float32]:
        """
        Return the expected mask in an image, (h, w) float32 about 0..1.

        :param template: (h, w) uint8, the template in the image.
        :param body: the body in the image's pixels.
        :param phase: gait phase in [0, 1).
        """
        kernel = _phase_kernel(phase)
        weight = float(kernel @ self._weight)
        mean = self._all / max(self._all_weight, 1e-6)
        if weight > 1e-6:
            own = np.tensordot(kernel, self._by_phase, 1) / weight
            trust = weight / (weight + _TRUST_AT)
            mean = trust * own + (1 - trust) * mean
        to_image = pixel_affine(template_to_image(body, *_GRID, _FILL))
        beyond = cv2.warpAffine(
            mean.astype(np.float32), to_image, template.shape[::-1], flags=cv2.INTER_LINEAR
        )
        expected = cv2.addWeighted(template, _FOLLOWS / 255, beyond, 1.0, 0.0, dtype=cv2.CV_32F)
        return np.asarray(expected)


def _phase_kernel(phase: float) -> NDArray[np.float32]:
    """Return the weight of each phase bin: a cyclic Gaussian of one bin's width."""
    distance = np.abs(np.arange(_BINS) - phase * _BINS)
    distance = np.minimum(distance, _BINS - distance)
    return np.exp(-0.5 * distance**2).astype(np.float32)
