# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's figures: the direct access table, what stages find in frames, and the phase."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from gait_segmentation.drawing import (
    REFINED_COLOUR,
    Colour,
    Image,
    draw_label,
    draw_match,
    draw_outline,
)
from gait_segmentation.gait_model.bank import TemplateBank, quantize
from gait_segmentation.geometry import Box
from gait_segmentation.matching.common_areas import splitting_ids
from gait_segmentation.matching.config import MatchingConfig
from gait_segmentation.matching.placements import antialiasing_side, resampled
from gait_tools.figures.walk import Phases, Shot
from gait_tools.sheets import contact_sheet, crop

CLEAR = 30
"""How far the likelihood of the pixel shown is from black and white, if there is such a pixel."""

SHOWN = 5
"""Frames side by side."""

TILE = (190, 240)
"""Width and height of a picture in pixels."""

ABOUT = 1.3
"""Height of what is shown, in those of the tallest box."""

WHITE: Colour = (255, 255, 255)


@dataclass(frozen=True)
class PixelTable:
    """
    What matching looks up at one pixel, for the templates of one view.

    ``order`` are the phases of the templates sorted by their values there, ``values`` these
    values, (K,) uint8, and ``split`` (256,) int32, how many are not above a value of the
    likelihood.  ``likelihood`` is that on the pixel grid of the templates.
    """

    likelihood: NDArray[np.uint8]
    row: int
    column: int
    order: NDArray[np.int64]
    values: NDArray[np.uint8]
    split: NDArray[np.int32]

    @property
    def value(self) -> int:
        """Return the likelihood of the pixel."""
        return int(self.likelihood[self.row, self.column])


def table_of(shot: Shot, bank: TemplateBank, config: MatchingConfig) -> PixelTable:
    """
    Return the table at the pixel at which the most templates of the matched view differ.

    :param shot: a frame with a match.
    """
    match, likelihood = shot.match, shot.track.likelihood
    assert match.body is not None
    body = match.body.scaled(likelihood.shape[1] / shot.given.image.shape[1])
    height, width = bank.grid
    tall = bank.fill * height
    side = max(config.blur, antialiasing_side(body.height / tall))
    values = resampled(likelihood, None, body, (1.0,), bank.grid, tall, side)[0][0]
    templates = quantize(bank.templates[match.sequence], config.levels).reshape(bank.phases, -1)
    order = np.argsort(templates, axis=0, kind='stable')
    ranked = np.ascontiguousarray(np.take_along_axis(templates, order, axis=0).T)
    split = splitting_ids(ranked)[1]
    flat = values.reshape(-1).astype(np.int64)
    different = (np.diff(ranked.astype(np.int16), axis=1) != 0).sum(axis=1)
    even = np.abs(split[np.arange(len(flat)), flat] / bank.phases - 0.5)
    clear = (flat >= CLEAR) & (flat <= 255 - CLEAR)
    pixel = int(np.lexsort((even, -different, ~clear))[0])
    row, column = divmod(pixel, width)
    return PixelTable(values, row, column, order[:, pixel], ranked[pixel], split[pixel])


def draw_access_table(table: PixelTable, number: int, azimuth_degrees: float) -> Figure:
    """
    Draw Fig. 1: the likelihood with the pixel, the templates split by it, and the whole table.

    :param number: of the frame.
    :param azimuth_degrees: of the view whose templates are compared.
    """
    split, count, v = int(table.split[table.value]), len(table.values), table.value
    figure = Figure(figsize=(9.2, 5.6), dpi=100, layout='constrained')
    axes: dict[str, Any] = figure.subplot_mosaic(
        [['image', 'bars'], ['image', 'curve']], width_ratios=(1, 2)
    )
    image, bars, curve = axes['image'], axes['bars'], axes['curve']
    image.imshow(table.likelihood, cmap='gray', vmin=0, vmax=255)
    image.plot(table.column, table.row, 's', ms=7, mfc='none', mec='tab:red')
    image.set_title(f'likelihood, frame {number}')
    image.set_xlabel(f'v = {v} at row {table.row}, column {table.column}', color='tab:red')
    ranks = np.arange(count)
    colours = np.where(ranks < split, 'tab:blue', 'tab:orange')
    bars.bar(ranks, table.values, color=colours, alpha=0.3)
    bars.bar(ranks, np.minimum(table.values, v), color=colours)
    bars.axhline(v, color='black', linewidth=1, label=f'likelihood v = {v}')
    bars.axvline(split - 0.5, color='tab:red', linewidth=1, label='left add g, right add v')
    bars.set_xticks(ranks, [str(phase) for phase in table.order], fontsize=6)
    bars.set_title(f'{count} templates of the view at {azimuth_degrees:.0f} degrees, sorted')
    bars.set_xlabel('template (number of its phase)')
    bars.set_ylabel('value g at the pixel')
    bars.legend()
    curve.step(range(256), table.split, where='post', color='gray')
    curve.plot(v, split, 'o', color='tab:red', label=f'split[{v}] = {split}')
    curve.set_title('the table of this pixel: looked up, nothing is compared')
    curve.set_xlabel('value v of the likelihood')
    curve.set_ylabel('splitting ID')
    curve.legend()
    return figure


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
    phase = shot.phase(phases)
    draw_label(placed, f'phase {phase:.2f}', (2, 2))
    mask = seen(shot.mask)
    cut = np.where(mask[..., None] > 127, seen(image), np.uint8(255))
    draw_outline(cut, mask, REFINED_COLOUR)
    error = shot.error()
    words = 'mask' if math.isnan(error) else f'mask, {error:.2f} % wrong'
    draw_label(cut, words, (2, 2))
    return [first, likelihood, placed, cut]


def draw_phases(phases: Phases) -> Figure:
    """Draw Fig. 4: both phases over the frames, over the true ones if they are known."""
    figure = Figure(figsize=(9.2, 3.2), dpi=100, layout='constrained')
    panels = (
        ('each frame alone', phases.alone, 'tab:orange'),
        ('best path', phases.path, 'tab:blue'),
    )
    for axes, (title, values, colour) in zip(figure.subplots(1, 2), panels, strict=True):
        axes.plot(phases.numbers, phases.shown_truth(), 'o', color='silver', ms=9)
        axes.plot(phases.numbers, values, 'o', color=colour, ms=5)
        error = phases.rms(values)
        words = '' if math.isnan(error) else f'\nRMS {error:.1f} % of the stride (grey: the truth)'
        axes.set_title(f'{title}: {phases.backward(values):.0f} % of the steps go back{words}')
        axes.set(xlabel='frame', ylabel='phase', ylim=(-0.03, 1.03))
    return figure
