# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""People cut out of one clip and put into another."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.variants.made_clip import Frame, MadeClip
from gait_segmentation.geometry import Box
from gait_tools.evaluation.metrics import true_box
from gait_tools.evaluation.truth import AMBIGUOUS, PERSON

__all__ = ['before_other_background', 'with_second_person']

Image = NDArray[np.uint8]

FEATHER = 0.8
"""Standard deviation of the seam about somebody who is pasted, pixels."""

BESIDE = 1.3
"""How far to either side of the person the second one starts and ends, in heights."""


def before_other_background(clip: MadeClip, other: MadeClip) -> list[MadeClip | None]:
    """Return the person of a clip before the background of another one's still camera."""
    backdrop = _background(other)
    if backdrop is None:
        return []
    height, width = clip.image(0).shape[:2]
    scale = max(height / backdrop.shape[0], width / backdrop.shape[1])
    backdrop = cv2.resize(backdrop, None, fx=scale, fy=scale, interpolation=cv2.INTER_LINEAR)
    # Of the same size, but for what the rounding has taken away.
    backdrop = np.asarray(cv2.resize(backdrop[:height, :width], (width, height)), np.uint8)

    def change(number: int, frame: Frame) -> Frame:
        image, truth = frame
        if truth is None:
            return backdrop, np.full((height, width), AMBIGUOUS, np.uint8)
        grain = np.random.default_rng([number, 3]).normal(0.0, 2.0, backdrop.shape)
        noisy = np.clip(backdrop + grain, 0, 255).astype(np.uint8)
        alone = np.where(truth == PERSON, truth, 0).astype(np.uint8)
        return _blend(noisy, image, _alpha(truth)), alone

    return [clip.changed(f'before-{other.name}', change)]


def with_second_person(clip: MadeClip, other: MadeClip) -> list[MadeClip | None]:
    """Return a clip through which the person of another one walks, behind and in front."""
    return [_crossed(clip, other, in_front=in_front) for in_front in (False, True)]


def _crossed(clip: MadeClip, other: MadeClip, *, in_front: bool) -> MadeClip | None:
    cut = [_cut_out(*frame) for frame in other.frames]
    people = [person for person in cut if person is not None]
    boxes = [None if truth is None else true_box(truth) for _, truth in clip.frames]
    known = [box for box in boxes if box is not None]
    if not people or not known:
        return None
    # So that a short clip of the other lasts for a long one of the person.
    to_and_fro = [*people, *people[-2:0:-1]]
    first, last = known[0], known[-1]
    side = -1.0 if last.center_x > first.center_x else 1.0
    frames: list[Frame] = []
    box = first
    for number, (image, truth) in enumerate(clip.frames):
        box = boxes[number] or box
        if truth is None:
            frames.append((image, None))
            continue
        colours, alpha = to_and_fro[number % len(to_and_fro)]
        time = number / max(len(clip.frames) - 1, 1)
        x = box.center_x - side * box.height * BESIDE * (2 * time - 1)
        layer, cover = _placed(colours, alpha, image.shape, x, box)
        person = _alpha(truth)
        if not in_front:
            cover = cover * (1.0 - person)
        hidden = cover > 0.5
        made = np.where(hidden & (truth == PERSON), 0, truth).astype(np.uint8)
        edge = (cover > 0.05) & (cover < 0.95) & (truth != 0)
        made[edge] = AMBIGUOUS
        frames.append((_blend(image, layer, cover), made))
    return clip.with_frames(f'{other.name}-{"front" if in_front else "behind"}', frames)


def _cut_out(image: Image, truth: Image | None) -> tuple[Image, NDArray[np.float32]] | None:
    """Return somebody's pixels and their cover, cropped; None if a border cuts them."""
    box = None if truth is None else true_box(truth)
    if truth is None or box is None:
        return None
    height, width = truth.shape
    if box.x < 2 or box.y < 2 or box.right > width - 2 or box.bottom > height - 2:
        return None
    rows = slice(int(box.y) - 2, int(box.bottom) + 2)
    columns = slice(int(box.x) - 2, int(box.right) + 2)
    return image[rows, columns], _alpha(truth)[rows, columns]


def _alpha(truth: Image) -> NDArray[np.float32]:
    person = (truth == PERSON).astype(np.float32)
    return np.asarray(cv2.GaussianBlur(person, (0, 0), FEATHER), np.float32)


def _blend(below: Image, above: Image, cover: NDArray[np.float32]) -> Image:
    weight = cover[..., None]
    return np.round(below * (1.0 - weight) + above * weight).astype(np.uint8)


def _placed(
    colours: Image,
    alpha: NDArray[np.float32],
    shape: tuple[int, ...],
    x: float,
    beside: Box,
) -> tuple[Image, NDArray[np.float32]]:
    """Put somebody as tall as a person at another column of an image, on the same ground."""
    rows, columns = alpha.shape
    scale = beside.height / rows
    left, top = x - scale * columns / 2, beside.bottom - scale * rows
    move, size = np.array([[scale, 0.0, left], [0.0, scale, top]]), (shape[1], shape[0])
    layer = cv2.warpAffine(colours, move, size, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(layer, np.uint8), np.asarray(cv2.warpAffine(alpha, move, size), np.float32)


def _background(clip: MadeClip) -> Image | None:
    """Return what a still camera sees without the person, None if it moves or never sees it."""
    if not clip.still:
        return None
    known = [(image, truth) for image, truth in clip.frames if truth is not None][::2]
    images = np.stack([image for image, _ in known])
    free = np.stack([truth for _, truth in known]) == 0
    hidden = np.broadcast_to(~free[..., None], images.shape)
    background = np.ma.median(np.ma.array(images, mask=hidden), axis=0).filled(0).astype(np.uint8)
    unseen = np.where(free.any(axis=0), 0, 255).astype(np.uint8)
    return np.asarray(cv2.inpaint(background, unseen, 3, cv2.INPAINT_TELEA), np.uint8)
