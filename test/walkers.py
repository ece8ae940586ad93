# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Short synthetic clips that tests of several stages share."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import cv2
import numpy as np

from benchmarks.synthetic import SyntheticConfig, SyntheticFrame, SyntheticSequence
from gait_segmentation.gait_model import TemplateBank, default_bank
from gait_segmentation.geometry import Box
from gait_tools.gait_model import BankSpec, build_bank


@cache
def small_bank() -> TemplateBank:
    """Return a bank of 8 directions and 12 phases, enough for tests and quickly built."""
    return build_bank(BankSpec(azimuths=8, phases=12, builds='average'))


@cache
def clip(pan: float = 2.0, frames: int = 16, seed: int = 3) -> tuple[SyntheticFrame, ...]:
    """Return a walk to the right before a cluttered, panned background."""
    config = SyntheticConfig(seed=seed, frames=frames, pan=pan, person_height=110.0)
    return tuple(SyntheticSequence(config))


def box_of(frame: SyntheticFrame, number: int = 0) -> Box:
    """Return the true box of a walker who is to be seen."""
    box = frame.boxes[number]
    assert box is not None
    return box


@cache
def sunlit(frames: int = 30, seed: int = 3) -> tuple[SyntheticFrame, ...]:
    """Return the same walk with a hard shadow, which leaves a twelfth of the light, and bluer."""
    left = np.array([0.11, 0.08, 0.07])
    lit = []
    for frame in clip(frames=frames, seed=seed):
        box = box_of(frame)
        # From the feet forwards, three fifths as long.
        fall = np.array([[1.0, -0.6, 0.6 * box.bottom], [0.0, 0.4, 0.6 * box.bottom - 2]])
        size = frame.masks[0].shape[::-1]
        shadow = cv2.warpAffine(frame.masks[0], fall, size, flags=cv2.INTER_LINEAR)
        depth = np.where(frame.masks[0] == 0, shadow, 0)[..., None] / 255
        light = (frame.image / 255) ** 2.2 * (1 - depth * (1 - left))
        image = (255 * light ** (1 / 2.2)).round().astype(np.uint8)
        lit.append(replace(frame, image=image))
    return tuple(lit)


def overlap(mask: np.ndarray, truth: np.ndarray) -> float:
    """Return J without the ambiguous pixels."""
    sure = (truth == 0) | (truth == 255)
    found, true = (mask > 0) & sure, truth == 255
    return float((found & true).sum() / max((found | true)[sure].sum(), 1))


@cache
def couple(frames: int = 12, seed: int = 7) -> tuple[SyntheticFrame, ...]:
    """
    Return two people who can both be seen in every frame, well apart.

    :param seed: where such are sought from; with the default the first are.
    """
    for number in range(seed, seed + 40):
        config = SyntheticConfig(seed=number, frames=frames, walkers=2, person_height=100.0)
        found = tuple(SyntheticSequence(config))
        boxes = [frame.boxes for frame in found]
        if all(apart(*pair) for pair in boxes):
            return found
    raise AssertionError('no couple')


def apart(one: Box | None, two: Box | None) -> bool:
    """Return whether two people are whole in an image of 320 pixels' width and do not touch."""
    if one is None or two is None or min(one.height, two.height) < 70:
        return False
    inside = min(one.x, two.x) > 4 and max(one.right, two.right) < 316
    return inside and (one.right + 12 < two.x or two.right + 12 < one.x)


def body(size: tuple[int, int] = (30, 60), phase: int = 0) -> np.ndarray:
    """Return one of the standard bank, (h, w) uint8."""
    image = default_bank().templates[0, phase]
    x, y, w, h = cv2.boundingRect(image)
    return np.where(cv2.resize(image[y : y + h, x : x + w], size) > 127, 255, 0)
