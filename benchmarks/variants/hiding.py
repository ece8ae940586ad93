# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Things in front of the person."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.variants.made_clip import Frame, MadeClip
from gait_segmentation.evaluation.metrics import true_box
from gait_segmentation.evaluation.truth import AMBIGUOUS, PERSON
from gait_segmentation.geometry import Box

__all__ = ['hidden']

POLE, WIDE, BENCH = 0.15, 0.35, 0.35
"""Width of a pole and of a wide post, height of what hides the legs, in heights of the person."""


def hidden(clip: MadeClip) -> list[MadeClip | None]:
    """
    Return the clip with a pole, a wide post, and a bench in the person's way.

    They stand still in the image, so there are none where the camera moves.
    """
    if not clip.still:
        return []
    middle = len(clip.frames) // 2
    boxes = [None if truth is None else true_box(truth) for _, truth in clip.frames]
    box = boxes[middle] or clip.box
    wide, pole = WIDE * box.height, POLE * box.height
    bench = Box(
        box.center_x - 0.8 * box.height,
        box.bottom - BENCH * box.height,
        1.6 * box.height,
        0.6 * box.height,
    )
    height = clip.image(0).shape[0]
    return [
        _behind(clip, 'pole', Box(box.center_x - pole / 2, 0, pole, height)),
        _behind(clip, 'wide', Box(box.center_x - wide / 2, 0, wide, height)),
        _behind(clip, 'bench', bench),
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
        return image, truth if truth is None else _without(truth, rows, columns)

    return clip.changed(name, change)


def _without(truth: NDArray[np.uint8], rows: slice, columns: slice) -> NDArray[np.uint8]:
    """Return a truth without what is hidden; nothing counts where all but nothing is left."""
    left = truth.copy()
    left[rows, columns] = 0
    seen, all_of = np.count_nonzero(left == PERSON), np.count_nonzero(truth == PERSON)
    if seen < 0.1 * all_of:
        left[left == PERSON] = AMBIGUOUS
    return left
