# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's Figs. 2 and 3: boxes, likelihoods, gait models at their places, and masks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.drawing import (
    REFINED_COLOUR,
    Colour,
    Image,
    draw_label,
    draw_match,
    draw_outline,
    draw_phase_dial,
)
from gait_segmentation.geometry import Box
from gait_segmentation.sheets import contact_sheet, crop
from gait_tools.evaluation.metrics import error_percent, evaluation_window
from gait_tools.figures.walk import Shot

__all__ = ['chosen', 'draw_frames']

SHOWN = 5
"""Frames side by side."""

TILE = (190, 240)
"""Width and height of a picture in pixels."""

ABOUT = 1.3
"""Height of what is shown, in those of the tallest box."""

WHITE: Colour = (255, 255, 255)


def chosen(shots: Sequence[Shot], count: int = SHOWN) -> list[Shot]:
    """Return frames evenly spread over those in which somebody is matched."""
    matched = [shot for shot in shots if shot.match.body is not None]
    places = np.linspace(0, len(matched) - 1, min(count, len(matched)))
    return [matched[round(place)] for place in places]


def draw_frames(shots: Sequence[Shot], phases: int) -> Image:
    """
    Draw four pictures of each frame, one below the other.

    :param shots: with a match.
    :param phases: of the bank.
    """
    tallest = max(_box(shot).height for shot in shots)
    rows: list[list[Image]] = [[], [], [], []]
    for shot in shots:
        for row, picture in zip(rows, _pictures(shot, tallest, phases), strict=True):
            row.append(picture)
    return contact_sheet([picture for row in rows for picture in row], len(shots))


def _box(shot: Shot) -> Box:
    box = shot.track.body or shot.match.box
    assert box is not None
    return box


def _pictures(shot: Shot, tallest: float, phases: int) -> list[Image]:
    """Return the image with boxes, the likelihood, the gait model, and the mask."""
    box, match, image = _box(shot), shot.match, shot.given.image
    height = round(ABOUT * tallest)
    width = round(height * TILE[0] / TILE[1])
    left, top = round(box.center_x - width / 2), round(box.center_y - height / 2)
    region, factor = Box(left, top, width, height), TILE[1] / height

    def seen(picture: NDArray[Any]) -> Image:
        """Return the region of a picture of any size laid over the image, enlarged."""
        if picture.shape[:2] != image.shape[:2]:
            size = (image.shape[1], image.shape[0])
            picture = np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_LINEAR))
        return crop(picture, region, TILE)

    def there(box: Box | None) -> Box | None:
        return box and Box(
            factor * (box.x - left),
            factor * (box.y - top),
            factor * box.width,
            factor * box.height,
        )

    first = seen(image)
    tracked, refined = there(shot.track.body), there(match.box)
    draw_match(first, tracked=tracked, angle=shot.track.angle, refined=refined)
    draw_label(first, f'frame {shot.given.number}', (2, 2))
    likelihood = np.asarray(cv2.cvtColor(seen(shot.track.likelihood), cv2.COLOR_GRAY2BGR))
    draw_label(likelihood, 'likelihood', (2, 2))
    model = seen(match.shape_prior)
    inside = model[..., None] / 255
    placed = (0.35 * seen(image) * (1 - inside) + 230 * inside).astype(np.uint8)
    phase = match.phase_index / phases
    draw_label(placed, f'phase {phase:.2f}', (2, 2))
    draw_phase_dial(placed, (TILE[0] - 22, 22), 15, phase, WHITE)
    mask = seen(shot.mask)
    cut = np.where(mask[..., None] > 127, seen(image), np.uint8(255))
    draw_outline(cut, mask, REFINED_COLOUR)
    draw_label(cut, _error(shot), (2, 2))
    return [first, likelihood, placed, cut]


def _error(shot: Shot) -> str:
    """Say how many pixels are wrong, if that is known."""
    truth = shot.given.truth
    if truth is None:
        return 'mask'
    window = evaluation_window(truth)
    error = error_percent(shot.mask[window], truth[window])
    return 'mask' if math.isnan(error) else f'mask, {error:.2f} % wrong'
