# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The same scene as other or worse cameras see it, or with things in front of the person."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.variants.made_clip import Frame, MadeClip
from gait_segmentation.geometry import Box
from gait_tools.evaluation.metrics import true_box
from gait_tools.evaluation.truth import AMBIGUOUS, PERSON

__all__ = ['CAMERAS', 'hidden']

Image = NDArray[np.uint8]
Change = Callable[[MadeClip, int, Image], NDArray[np.generic]]
"""Makes an image, of any type, of the clip, a frame's number and its image."""

TILTS = (-18.0, 18.0)
"""Angles that a camera is turned by, degrees."""

DARK, LOW_GAIN, LOW_OFFSET = 0.3, 0.35, 90.0
NOISE, BLUR, QUALITY = 12.0, 0.012, 15
"""Deviation of noise in grey levels and of blur in heights of the person, and of a JPEG."""

SHADES, SHADE_EDGE = (0.6, 0.4), 0.03
"""Light that is left in the shade; width of its edge, in heights of the person."""

GAIN, GAIN_SECONDS = 0.25, 1.6
"""How far and how fast a changing gain goes up and down."""

POLE, WIDE, BENCH = 0.15, 0.35, 0.35
"""Width of a pole and of a wide post, height of what hides the legs, in heights of the person."""


def _changed(change: Change, clip: MadeClip, name: str = '') -> list[MadeClip | None]:
    """Return the clip with other images of the same truth."""

    def made(number: int, frame: Frame) -> Frame:
        image = change(clip, number, frame[0])
        return np.clip(np.round(image), 0, 255).astype(np.uint8), frame[1]  # type: ignore[arg-type]

    return [clip.changed(name, made)]


def _moved(
    name: str,
    warp: Callable[[Image, int], NDArray[np.generic]],
    smooth: int,
    clip: MadeClip,
) -> MadeClip | None:
    """Return the clip with images and truth warped alike, but for the interpolation."""

    def made(_: int, frame: Frame) -> Frame:
        image, truth = (
            None if each is None else np.asarray(warp(each, how), np.uint8)
            for each, how in zip(frame, (smooth, cv2.INTER_NEAREST), strict=True)
        )
        assert image is not None
        return image, truth

    return clip.changed(name, made)


def _flipped(clip: MadeClip) -> list[MadeClip | None]:
    return [_moved('', lambda each, _: np.ascontiguousarray(each[:, ::-1]), 0, clip)]


def _tilted(clip: MadeClip) -> list[MadeClip | None]:
    """Return the clip from a camera turned to either side; what it did not see is ambiguous."""
    height, width = clip.image(0).shape[:2]

    def turned(angle: float) -> MadeClip | None:
        turn = cv2.getRotationMatrix2D(((width - 1) / 2, (height - 1) / 2), angle, 1.0)

        def warp(each: Image, how: int) -> NDArray[np.generic]:
            border = cv2.BORDER_CONSTANT if each.ndim == 2 else cv2.BORDER_REFLECT_101
            return cv2.warpAffine(
                each, turn, (width, height), flags=how, borderMode=border, borderValue=AMBIGUOUS
            )

        return _moved(f'{angle:+g}', warp, cv2.INTER_LINEAR, clip)

    return [turned(angle) for angle in TILTS]


def _resized(scale: float, smooth: int, clip: MadeClip) -> list[MadeClip | None]:
    height, width = clip.image(0).shape[:2]
    size = (round(width * scale), round(height * scale))
    return [_moved('', lambda each, how: cv2.resize(each, size, interpolation=how), smooth, clip)]


def _jpeg(clip: MadeClip, number: int, image: Image) -> NDArray[np.generic]:
    data = cv2.imencode('.jpg', image, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])[1]
    return np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR))


def _noisy(clip: MadeClip, number: int, image: Image) -> NDArray[np.generic]:
    return image + np.random.default_rng([number, 7]).normal(0.0, NOISE, image.shape)


def _blurred(clip: MadeClip, number: int, image: Image) -> NDArray[np.generic]:
    return cv2.GaussianBlur(image, (0, 0), max(BLUR * clip.box.height, 0.5))


def _hunting(clip: MadeClip, number: int, image: Image) -> NDArray[np.generic]:
    return image * (1.0 + GAIN * math.sin(2 * math.pi * number / (GAIN_SECONDS * clip.fps)))


def _shaded(clip: MadeClip) -> list[MadeClip | None]:
    """
    Return the clip with a shade beyond the middle of the person's way, lighter and darker.

    Its edge stands still in the image, so there is none where the camera moves: it would pass over
    the ground there.
    """
    feet = [box for _, truth in clip.frames if truth is not None and (box := true_box(truth))]
    if not clip.still or not feet:
        return []
    (x, y), (to_x, to_y) = ((box.center_x, box.bottom) for box in (feet[0], feet[-1]))
    way = max(math.hypot(to_x - x, to_y - y), 1.0)
    rows, columns = np.mgrid[: clip.image(0).shape[0], : clip.image(0).shape[1]]
    along = (columns - (x + to_x) / 2) * (to_x - x) + (rows - (y + to_y) / 2) * (to_y - y)
    beyond = 1 / (1 + np.exp(np.clip(-along / (way * SHADE_EDGE * clip.box.height), -50, 50)))

    def under(light: float) -> list[MadeClip | None]:
        share = (1 - (1 - light) * beyond)[..., None]
        return _changed(lambda clip, number, image: image * share, clip, f'{light:g}')

    return [made for light in SHADES for made in under(light)]


CAMERAS: dict[str, Callable[[MadeClip], list[MadeClip | None]]] = {
    'flip': _flipped,
    'tilt': _tilted,
    'half': partial(_resized, 0.5, cv2.INTER_AREA),
    'double': partial(_resized, 2.0, cv2.INTER_CUBIC),
    'dark': partial(_changed, lambda clip, number, image: image * DARK),
    'low': partial(_changed, lambda clip, number, image: image * LOW_GAIN + LOW_OFFSET),
    'grey': partial(_changed, lambda clip, number, image: cv2.cvtColor(
        cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR)),
    'jpeg': partial(_changed, _jpeg),
    'noise': partial(_changed, _noisy),
    'blur': partial(_changed, _blurred),
    'gain': partial(_changed, _hunting),
    'shade': _shaded,
}  # fmt: skip
"""What a kind makes of one clip, by the kind's name."""


def hidden(clip: MadeClip) -> list[MadeClip | None]:
    """
    Return the clip with a pole, a wide post, and a bench in the person's way.

    They stand still in the image, so there are none where the camera moves.
    """
    if not clip.still:
        return []
    truth = clip.truth(len(clip.frames) // 2)
    box = (None if truth is None else true_box(truth)) or clip.box
    high, tall = clip.image(0).shape[0], box.height
    legs = Box.from_center(box.center_x, box.bottom - (BENCH - 0.3) * tall, 1.6 * tall, 0.6 * tall)
    return [
        _behind(clip, 'pole', Box(box.center_x - POLE * tall / 2, 0, POLE * tall, high)),
        _behind(clip, 'wide', Box(box.center_x - WIDE * tall / 2, 0, WIDE * tall, high)),
        _behind(clip, 'bench', legs),
    ]


def _behind(clip: MadeClip, name: str, thing: Box) -> MadeClip | None:
    rng = np.random.default_rng([len(name), 5])
    colour = rng.uniform(60, 190, 3)
    shape = clip.image(0).shape[:2]
    rows = slice(max(round(thing.y), 0), min(round(thing.bottom), shape[0]))
    columns = slice(max(round(thing.x), 0), min(round(thing.right), shape[1]))
    texture = cv2.GaussianBlur(rng.normal(0.0, 40.0, (*shape, 3)), (0, 0), 3.0)

    def change(number: int, frame: Frame) -> Frame:
        image, truth = frame[0].copy(), frame[1]
        grain = np.random.default_rng([number, 9]).normal(0.0, 2.0, (*shape, 3))
        painted = np.clip(colour + texture + grain, 0, 255).astype(np.uint8)
        image[rows, columns] = painted[rows, columns]
        if truth is None:
            return image, None
        left = truth.copy()
        left[rows, columns] = 0
        # Nothing counts where all but nothing is left.
        if np.count_nonzero(left == PERSON) < 0.1 * np.count_nonzero(truth == PERSON):
            left[left == PERSON] = AMBIGUOUS
        return image, left

    return clip.changed(name, change)
