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
    BACKDROP,
    REFINED_COLOUR,
    TRACKED_COLOUR,
    Colour,
    Image,
    draw_box,
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

CLEAR = 30  # how far the likelihood of the pixel shown is from black and white, if there is one
CELLS = 13  # values in the written part of the table
SHOWN = 5  # frames side by side
TILE = (190, 240)  # width and height of a picture in pixels
ABOUT = 1.3  # height of what is shown, in those of the tallest box
STRIP = 20  # height of the strip above a picture that its words are in, in pixels
LIKELY_COLOUR: Colour = (40, 225, 255)  # of the box about what is likely where the template stands
DASH = 4  # its dashes, in pixels: what lies under it is seen between them
LEGEND = (
    ('tracked box', TRACKED_COLOUR),
    ('refined box: the tracked one where the path places it', REFINED_COLOUR),
    ('dashed: about what is likely there', LIKELY_COLOUR),
)


@dataclass(frozen=True)
class PixelTable:
    """
    What matching looks up at one pixel, for the templates of one view.

    ``order`` are their phases sorted by their ``values`` there; ``first`` and ``second`` say of
    each likelihood, (256,), how many templates are below it, and how many not above it.
    """

    likelihood: NDArray[np.uint8]
    row: int
    column: int
    order: NDArray[np.int64]
    values: NDArray[np.uint8]
    first: NDArray[np.int32]
    second: NDArray[np.int32]

    @property
    def value(self) -> int:
        """Return the likelihood of the pixel."""
        return int(self.likelihood[self.row, self.column])

    @property
    def ids(self) -> tuple[int, int]:
        """Return both splitting IDs of it."""
        return int(self.first[self.value]), int(self.second[self.value])


def table_of(shot: Shot, bank: TemplateBank, config: MatchingConfig) -> PixelTable:
    """Return the table where the likelihood is clear and most templates of the view differ."""
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
    below, split = splitting_ids(ranked)
    flat = values.reshape(-1).astype(np.int64)
    pixels = np.arange(len(flat))
    first, second = below[pixels, flat], split[pixels, flat]
    different = (np.diff(ranked.astype(np.int16), axis=1) != 0).sum(axis=1)
    even = np.abs(second / bank.phases - 0.5)
    clear = (flat >= CLEAR) & (flat <= 255 - CLEAR)
    telling = (first > 0) & (first < second) & (second < bank.phases)
    pixel = int(np.lexsort((even, -different, ~telling, ~clear))[0])
    row, column = divmod(pixel, width)
    ids = below[pixel], split[pixel]
    return PixelTable(values, row, column, order[:, pixel], ranked[pixel], *ids)


def draw_access_table(table: PixelTable, number: int, azimuth_degrees: float) -> Figure:
    """Draw Fig. 1: the pixel, the templates' values unsorted and sorted, and the table."""
    (first, second), count, v = table.ids, len(table.values), table.value
    figure = Figure(figsize=(11, 8), dpi=100, layout='constrained')
    axes: dict[str, Any] = figure.subplot_mosaic(
        [['image', 'unsorted'], ['image', 'sorted'], ['rows', 'curve'], ['rows', 'table']],
        width_ratios=(1, 2.6),
        height_ratios=(1, 1.25, 0.9, 0.35),
    )
    image = axes['image']
    image.imshow(table.likelihood, cmap='gray', vmin=0, vmax=255)
    image.plot(table.column, table.row, 's', ms=8, mfc='none', mec='tab:red', mew=2)
    image.set_title(f'likelihood of the person,\nframe {number}')
    where = f'row {table.row}, column {table.column}'
    image.set_xlabel(f'one pixel ({where}):\nv = {v} of 255', color='tab:red', size=11)
    image.set(xticks=[], yticks=[])
    words = (
        'A template adds min(g, v) to its sum.\n\n'
        f'Blue: g < v, adds g:\nthe first {first} of {count}\n\n'
        f'Grey: g = v, either is the same:\n{second - first} of {count}\n\n'
        f'Orange: g > v, adds v:\nthe last {count - second} of {count}\n\n'
        'The dark part of a bar is added.\nNothing is compared: both IDs\nare looked up by v.'
    )
    axes['rows'].axis('off')
    axes['rows'].text(0, 1, words, va='top', transform=axes['rows'].transAxes)
    ranks = np.arange(count)
    kinds = np.where(ranks < first, 'tab:blue', np.where(ranks < second, 'gray', 'tab:orange'))
    back = np.argsort(table.order)
    title = f'(a) {count} templates of the view at {azimuth_degrees:.0f} degrees, by phase'
    _draw_row(axes['unsorted'], title, table.values[back], kinds[back], v)
    axes['unsorted'].set_xticks(ranks, [str(rank) for rank in ranks], fontsize=7)
    ordered = axes['sorted']
    _draw_row(ordered, '(b) the same, sorted by value', table.values, kinds, v)
    ordered.set_xticks(ranks, [str(phase) for phase in table.order], fontsize=7)
    ordered.set_xlabel('template (number of its phase)')
    red: dict[str, Any] = {
        'color': 'tab:red',
        'va': 'center',
        'bbox': {'color': 'white', 'pad': 1},
    }
    for place, words, side in (
        (first, f'first ID = {first} ', 'right'),
        (second, f' second ID = {second}', 'left'),
    ):
        ordered.axvline(place - 0.5, color='tab:red', linewidth=1.5)
        ordered.text(place - 0.5, 275, words, ha=side, **red)
    curve = axes['curve']
    curve.step(range(256), table.second, where='mid', color='black', label='second ID: g <= v')
    dashed = {'color': 'tab:cyan', 'label': 'first ID: g < v'}
    curve.step(range(256), table.first, '--', where='mid', **dashed)
    curve.axvline(v, color='tab:red', linewidth=1)
    curve.plot([v, v], [first, second], 'o', color='tab:red', ms=4)
    curve.set_title('(c) the table of this pixel: how many templates are below, and not above v')
    curve.set_xlabel('value v that the likelihood may have')
    curve.set(ylabel='splitting IDs', xlim=(-2, 257))
    curve.legend(loc='lower right')
    _draw_cells(axes['table'], table)
    return figure


def _draw_row(axes: Any, title: str, values: NDArray[np.uint8], kinds: Any, v: int) -> None:
    """Draw a row of templates' values, and which part of them is added."""
    ranks = np.arange(len(values))
    axes.bar(ranks, values, color=kinds, alpha=0.3)
    axes.bar(ranks, np.minimum(values, v), color=kinds)
    axes.axhline(v, color='black', linewidth=1)
    axes.text(len(values) - 0.3, v, f' v = {v}', va='center')
    axes.set_title(title)
    axes.set(xlim=(-0.8, len(values) - 0.2), ylim=(0, 295), yticks=[0, 100, 200])
    axes.set_ylabel('value g')


def _draw_cells(axes: Any, table: PixelTable) -> None:
    """Write the part of the table about the value of the likelihood."""
    left = min(max(table.value - CELLS // 2, 0), 256 - CELLS)
    shown = range(left, left + CELLS)
    rows = [
        [str(each) for each in row] for row in (shown, table.first[shown], table.second[shown])
    ]
    axes.axis('off')
    cells = axes.table(
        rows, rowLabels=['v', 'first ID', 'second ID'], cellLoc='center', bbox=(0.07, 0, 0.93, 1)
    )
    for row in range(3):
        cells[row, table.value - left].set_facecolor('mistyrose')
        cells[row, table.value - left].set_text_props(color='tab:red', weight='bold')


def chosen(shots: Sequence[Shot], count: int = SHOWN) -> list[Shot]:
    """Return frames evenly spread over those in which somebody is matched."""
    matched = [shot for shot in shots if shot.match.body is not None]
    places = np.linspace(0, len(matched) - 1, min(count, len(matched)))
    return [matched[round(place)] for place in places]


def draw_frames(shots: Sequence[Shot], phases: int) -> Image:
    """Draw four pictures of each frame, one below the other, below a legend of the boxes."""
    tallest = max(_box(shot).height for shot in shots)
    rows: list[list[Image]] = [[], [], [], []]
    for shot in shots:
        for row, picture in zip(rows, _pictures(shot, tallest, phases), strict=True):
            row.append(picture)
    sheet = contact_sheet([picture for row in rows for picture in row], len(shots))
    return np.vstack([_legend(sheet.shape[1]), sheet])


def _legend(width: int) -> Image:
    """Return the words about the boxes, on as many lines as the width asks for."""
    lines: list[Image] = []
    left = width
    for words, colour in LEGEND:
        (long, _), _ = cv2.getTextSize(words, cv2.FONT_HERSHEY_SIMPLEX, 0.4, 1)
        if left + long > width:
            lines.append(_strip(width))
            left = 4
        draw_label(lines[-1], words, (left, 2), colour)
        left += long + 24
    return np.vstack(lines)


def _strip(width: int) -> Image:
    return np.full((STRIP, width, 3), BACKDROP, np.uint8)


def _captioned(picture: Image, words: str) -> Image:
    """Return a picture below its words."""
    strip = _strip(picture.shape[1])
    draw_label(strip, words, (2, 2))
    return np.vstack([strip, picture])


def _box(shot: Shot) -> Box:
    box = shot.track.body or shot.match.placed
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

    def there(box: Box) -> Box:
        return box.shifted(-left, -top).scaled(factor)

    first = seen(image)
    tracked, refined, likely = (
        each and there(each) for each in (shot.track.body, match.placed, match.box)
    )
    draw_match(first, tracked=tracked, angle=shot.track.angle, refined=refined)
    if likely not in (None, refined):
        dashed = first.copy()
        draw_box(dashed, likely, LIKELY_COLOUR)
        rows, columns = np.indices(first.shape[:2])
        gaps = (rows + columns) // DASH % 2 == 0
        first[gaps] = dashed[gaps]
    likelihood = np.asarray(cv2.cvtColor(seen(shot.track.likelihood), cv2.COLOR_GRAY2BGR))
    model = seen(match.shape_prior)
    inside = model[..., None] / 255
    placed = (0.35 * seen(image) * (1 - inside) + 230 * inside).astype(np.uint8)
    mask = seen(shot.mask)
    cut = np.where(mask[..., None] > 127, seen(image), np.uint8(255))
    draw_outline(cut, mask, REFINED_COLOUR)
    error = shot.error()
    words = 'mask' if math.isnan(error) else f'mask, {error:.2f} % wrong'
    return [
        _captioned(first, f'frame {shot.given.number}: boxes'),
        _captioned(likelihood, 'likelihood'),
        _captioned(placed, f'gait model, phase {shot.phase(phases):.2f}'),
        _captioned(cut, words),
    ]


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
