# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The same scene as other or worse cameras see it."""

from __future__ import annotations

import math
from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.variants.made_clip import Frame, MadeClip
from gait_segmentation.evaluation.metrics import true_box
from gait_segmentation.evaluation.truth import AMBIGUOUS

__all__ = [
    'blurred',
    'changing_gain',
    'compressed',
    'dark',
    'double_size',
    'flipped',
    'grey',
    'half_size',
    'low_contrast',
    'noisy',
    'shaded',
    'tilted',
]

Image = NDArray[np.uint8]

TILTS = (-18.0, 18.0)
"""Angles that a camera is turned by, degrees."""

DARK, LOW_GAIN, LOW_OFFSET = 0.3, 0.35, 90.0
NOISE = 12.0
"""Standard deviation of the added noise, grey levels."""

BLUR = 0.012
"""Standard deviation of the blur, in heights of the person."""

QUALITY = 15
"""JPEG quality of compressed frames."""

SHADES, SHADE_EDGE = (0.6, 0.4), 0.03
"""Light that is left in the shade; width of its edge, in heights of the person."""

GAIN, GAIN_SECONDS = 0.25, 1.6
"""How far and how fast a changing gain goes up and down."""


def flipped(clip: MadeClip) -> list[MadeClip | None]:
    """Return the clip mirrored."""
    return [_each(clip, lambda _, image: _mirrored(image), _mirrored)]


def tilted(clip: MadeClip) -> list[MadeClip | None]:
    """Return the clip from a camera turned to either side; what it did not see is ambiguous."""
    return [_turned(clip, angle) for angle in TILTS]


def half_size(clip: MadeClip) -> list[MadeClip | None]:
    """Return the clip at half the size."""
    return [_resized(clip, 0.5)]


def double_size(clip: MadeClip) -> list[MadeClip | None]:
    """Return the clip at twice the size."""
    return [_resized(clip, 2.0)]


def dark(clip: MadeClip) -> list[MadeClip | None]:
    """Return the clip under-exposed."""
    return [_each(clip, lambda _, image: _levels(image * DARK))]


def low_contrast(clip: MadeClip) -> list[MadeClip | None]:
    """Return the clip as through haze."""
    return [_each(clip, lambda _, image: _levels(image * LOW_GAIN + LOW_OFFSET))]


def grey(clip: MadeClip) -> list[MadeClip | None]:
    """Return the clip of a camera without colours."""

    def change(_: int, image: Image) -> Image:
        return cv2.cvtColor(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR)

    return [_each(clip, change)]


def compressed(clip: MadeClip) -> list[MadeClip | None]:
    """Return the clip with every frame as a coarse JPEG."""

    def change(_: int, image: Image) -> Image:
        data = cv2.imencode('.jpg', image, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])[1]
        return np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), np.uint8)

    return [_each(clip, change)]


def noisy(clip: MadeClip) -> list[MadeClip | None]:
    """Return the clip with a sensor's noise in the dark."""

    def change(number: int, image: Image) -> Image:
        rng = np.random.default_rng([number, 7])
        return _levels(image + rng.normal(0.0, NOISE, image.shape))

    return [_each(clip, change)]


def blurred(clip: MadeClip) -> list[MadeClip | None]:
    """Return the clip out of focus."""
    sigma = max(BLUR * clip.box.height, 0.5)
    return [_each(clip, lambda _, image: _levels(cv2.GaussianBlur(image, (0, 0), sigma)))]


def shaded(clip: MadeClip) -> list[MadeClip | None]:
    """
    Return the clip with a shade beyond the middle of the person's way, lighter and darker.

    Its edge stands still in the image, so there is none where the camera moves: it would pass over
    the ground there.
    """
    if not clip.still:
        return []
    feet = [box for _, truth in clip.frames if truth is not None and (box := true_box(truth))]
    if not feet:
        return []
    (x, y), (to_x, to_y) = ((box.center_x, box.bottom) for box in (feet[0], feet[-1]))
    way = max(math.hypot(to_x - x, to_y - y), 1.0)
    height, width = clip.image(0).shape[:2]
    rows, columns = np.mgrid[:height, :width]
    along = (columns - (x + to_x) / 2) * (to_x - x) + (rows - (y + to_y) / 2) * (to_y - y)
    beyond = 1 / (1 + np.exp(np.clip(-along / (way * SHADE_EDGE * clip.box.height), -50, 50)))

    def under(light: float) -> MadeClip | None:
        share = (1 - (1 - light) * beyond)[..., None]
        return clip.changed(f'{light:g}', lambda _, f: (_levels(f[0] * share), f[1]))

    return [under(light) for light in SHADES]


def changing_gain(clip: MadeClip) -> list[MadeClip | None]:
    """Return the clip of a camera whose exposure hunts."""

    def change(number: int, image: Image) -> Image:
        wave = math.sin(2 * math.pi * number / (GAIN_SECONDS * clip.fps))
        return _levels(image * (1.0 + GAIN * wave))

    return [_each(clip, change)]


def _levels(values: NDArray[np.generic]) -> Image:
    return np.clip(np.round(values), 0, 255).astype(np.uint8)  # type: ignore[arg-type]


def _mirrored(image: Image) -> Image:
    return np.ascontiguousarray(image[:, ::-1])


def _each(
    clip: MadeClip,
    change: Callable[[int, Image], Image],
    change_truth: Callable[[Image], Image] | None = None,
) -> MadeClip | None:
    def changed(number: int, frame: Frame) -> Frame:
        image, truth = frame
        if truth is not None and change_truth is not None:
            truth = change_truth(truth)
        return change(number, image), truth

    return clip.changed('', changed)


def _turned(clip: MadeClip, angle: float) -> MadeClip | None:
    height, width = clip.image(0).shape[:2]
    turn = cv2.getRotationMatrix2D(((width - 1) / 2, (height - 1) / 2), angle, 1.0)

    def changed(_: int, frame: Frame) -> Frame:
        image, truth = frame
        size = (width, height)
        image = cv2.warpAffine(image, turn, size, borderMode=cv2.BORDER_REFLECT_101)
        if truth is not None:
            truth = cv2.warpAffine(
                truth, turn, size, flags=cv2.INTER_NEAREST, borderValue=AMBIGUOUS
            )
        return np.asarray(image, np.uint8), truth

    return clip.changed(f'{angle:+g}', changed)


def _resized(clip: MadeClip, scale: float) -> MadeClip | None:
    height, width = clip.image(0).shape[:2]
    size = (round(width * scale), round(height * scale))
    how = cv2.INTER_AREA if scale < 1 else cv2.INTER_CUBIC
    return _each(
        clip,
        lambda _, image: np.asarray(cv2.resize(image, size, interpolation=how), np.uint8),
        lambda truth: np.asarray(
            cv2.resize(truth, size, interpolation=cv2.INTER_NEAREST), np.uint8
        ),
    )
