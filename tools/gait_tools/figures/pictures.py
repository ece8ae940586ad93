# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's figures: the direct access table, what stages find in frames, and the phase."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank, quantize
from gait_segmentation.geometry import BodyFrame, Box
from gait_segmentation.matching.common_areas import splitting_ids
from gait_segmentation.matching.config import MatchingConfig
from gait_segmentation.matching.placements import antialiasing_side, resampled
from gait_tools.figures.walk import Phases, Shot

CLEAR = 30  # how far the likelihood of the pixel shown is from black and white, if there is one
CELLS = 13  # values in the written part of the table
SHOWN = 5  # frames side by side
ABOUT = 1.3  # height of what is shown, in those of the tallest box
GREEN = '#3ce63c'
BOXES: dict[str, dict[str, Any]] = {
    'tracked box': {'color': '#ff2828'},
    'refined box: the tracked one where the path places it': {'color': GREEN},
    'about what is likely there': {'color': '#ffe128', 'linestyle': '--'},
}
"""The legend of boxes, and how they are drawn."""


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


def draw_frames(shots: Sequence[Shot], phases: int) -> Figure:
    """Draw four pictures of each frame, one below the other, below a legend of the boxes."""
    tall = ABOUT * max(_box(shot).height for shot in shots)
    figure = Figure(figsize=(2.1 * len(shots), 10), dpi=100, layout='constrained')
    for column, shot in zip(figure.subplots(4, len(shots), squeeze=False).T, shots, strict=True):
        _draw_frame(column, shot, tall, phases)
    handles = [Line2D([], [], label=label, **style) for label, style in BOXES.items()]
    figure.suptitle(' ', size=24)  # makes room for the legend
    figure.legend(handles=handles, loc='upper center', ncols=len(BOXES))
    return figure


def _box(shot: Shot) -> Box:
    box = shot.track.body or shot.match.placed
    assert box is not None
    return box


def _draw_frame(column: Sequence[Axes], shot: Shot, tall: float, phases: int) -> None:
    """Draw the image with boxes, the likelihood, the gait model, and the mask."""
    box, match, image = _box(shot), shot.match, shot.given.image[..., ::-1]
    # All is laid over the image, whatever its size.
    about: dict[str, Any] = {'extent': (0, image.shape[1], image.shape[0], 0)}
    about |= {'cmap': 'gray', 'vmin': 0, 'vmax': 255}
    error = shot.error()
    cut = np.where(shot.mask[..., None] > 127, image, np.uint8(255))
    pictures = (
        (f'frame {shot.given.number}: boxes', image),
        ('likelihood', shot.track.likelihood),
        (f'gait model, phase {shot.phase(phases):.2f}', (0.35 * image).astype(np.uint8)),
        ('mask' if math.isnan(error) else f'mask, {error:.2f} % wrong', cut),
    )
    wide = 0.8 * tall
    for axes, (title, picture) in zip(column, pictures, strict=True):
        axes.imshow(picture, **about)
        axes.set_title(title, fontsize=9)
        axes.set(xticks=[], yticks=[], facecolor='0.2')
        axes.set_xlim(box.center_x - wide / 2, box.center_x + wide / 2)
        axes.set_ylim(box.center_y + tall / 2, box.center_y - tall / 2)
    likely = None if match.box == match.placed else match.box
    angles = shot.track.angle, 0.0, 0.0
    for each, angle, style in zip(
        (shot.track.body, match.placed, likely), angles, BOXES.values(), strict=True
    ):
        if each is not None:
            body = BodyFrame(each.center_x, each.center_y, each.height, angle)
            column[0].add_patch(Polygon(body.corners(each.width), fill=False, **style))
    prior = match.shape_prior
    column[2].imshow(np.full_like(prior, 230), alpha=prior / 255, **about)
    size = (0, image.shape[1], 0, image.shape[0])
    column[3].contour(shot.mask, [127], colors=[GREEN], origin='lower', extent=size)


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
