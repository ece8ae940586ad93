# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's Fig. 1: the sorted direct access table of one pixel."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.drawing import TRACKED_COLOUR, Image
from gait_segmentation.gait_model.bank import TemplateBank, quantize
from gait_segmentation.geometry import template_to_image
from gait_segmentation.matching.common_areas import splitting_ids
from gait_segmentation.matching.config import MatchingConfig
from gait_segmentation.matching.sampling import antialiasing_side, resampled
from gait_tools.figures.canvas import BLACK, BLUE, GREY, ORANGE, Plot, blank, text
from gait_tools.figures.walk import Shot

__all__ = ['PixelTable', 'draw_access_table', 'table_of']

CLEAR = 30
"""How far the likelihood of the pixel shown is from black and white, if there is such a pixel."""

_SIZE = (920, 560)
_LEFT = 330
_PALE = 0.7


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

    def added(self) -> NDArray[np.uint8]:
        """Return what each template of the order adds to its sum, by the table."""
        split = self.split[self.value]
        rest = np.full(len(self.values) - split, self.value, np.uint8)
        return np.concatenate([self.values[:split], rest])


def table_of(shot: Shot, bank: TemplateBank, config: MatchingConfig) -> PixelTable:
    """
    Return the table at the pixel at which the most templates of the matched view differ.

    :param shot: a frame with a match.
    """
    match, likelihood = shot.match, shot.track.likelihood
    assert match.body is not None
    body = match.body.scaled(likelihood.shape[1] / shot.given.image.shape[1])
    height, width = bank.grid
    grid = template_to_image(body, height, width, bank.fill)
    side = max(config.blur, antialiasing_side(body.height / (bank.fill * height)))
    values = resampled(likelihood, None, [grid], (width, height), side)[0][0]
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


def draw_access_table(table: PixelTable, number: int, azimuth_degrees: float) -> Image:
    """
    Draw the likelihood with the pixel, the sorted templates split by it, and the whole table.

    :param number: of the frame.
    :param azimuth_degrees: of the view whose templates are compared.
    """
    image = blank(*_SIZE)
    split, count = int(table.split[table.value]), len(table.values)
    _draw_likelihood(image, table, number)
    text(
        image,
        f'{count} templates of the view at {azimuth_degrees:.0f} degrees, sorted',
        (_LEFT, 24),
    )
    bars = Plot(image, (_LEFT, 60, 900, 300), (0, count), (0, 255))
    for rank, (phase, value) in enumerate(zip(table.order, table.values, strict=True)):
        colour = BLUE if rank < split else ORANGE
        pale = tuple(round(_PALE * 255 + (1 - _PALE) * each) for each in colour)
        added = min(int(value), table.value)
        for top, shade in ((int(value), pale), (added, colour)):
            left, high = bars.at(rank + 0.12, top)
            right, low = bars.at(rank + 0.88, 0)
            corner = (round(right), round(low))
            cv2.rectangle(image, (round(left), round(high)), corner, shade, -1)
        x, y = bars.at(rank + 0.5, 0)
        text(image, f'{phase}', (x, y + 14), size=0.33, anchor=0.5)
    bars.axes(
        (), (0, 64, 128, 192, 255), ('template (number of its phase)', 'value g at the pixel')
    )
    bars.line(((0, table.value), (count, table.value)), BLACK, 1)
    text(
        image,
        f'v = {table.value}',
        (bars.at(count, table.value)[0], bars.at(0, table.value)[1] - 5),
        anchor=1,
    )
    bars.line(((split, 0), (split, 255)), TRACKED_COLOUR, 1)
    middle = bars.at(split, 0)[0]
    text(image, 'these add g', (middle - 8, 52), BLUE, anchor=1)
    text(image, 'these add v', (middle + 8, 52), ORANGE)
    curve = Plot(image, (_LEFT, 400, 900, 515), (0, 255), (0, count))
    steps = [(v, int(at)) for v, at in enumerate(table.split)]
    curve.line([point for v, at in steps for point in ((v, at), (v + 1, at))], GREY)
    curve.axes((0, 64, 128, 192, 255), (0, count), ('value v of the likelihood', 'splitting ID'))
    curve.dots([(table.value, split)], TRACKED_COLOUR, 4)
    words = f'split[{table.value}] = {split}'
    x, y = curve.at(table.value, split)
    text(image, words, (x + 8, y + 16 if split > count / 2 else y - 8), TRACKED_COLOUR)
    text(image, 'the table of this pixel: looked up, nothing is compared', (_LEFT, 370))
    return image


def _draw_likelihood(image: Image, table: PixelTable, number: int) -> None:
    """Draw the likelihood on the grid of the templates, with the pixel in a red frame."""
    text(image, f'likelihood, frame {number}', (16, 24))
    height, width = table.likelihood.shape
    factor = max(1, min(256 // width, 440 // height))
    size = (width * factor, height * factor)
    picture = cv2.resize(table.likelihood, size, interpolation=cv2.INTER_NEAREST)
    top, left = 40, 16
    image[top : top + size[1], left : left + size[0]] = picture[..., None]
    x, y = left + table.column * factor, top + table.row * factor
    cv2.rectangle(image, (x - 2, y - 2), (x + factor + 1, y + factor + 1), TRACKED_COLOUR, 1)
    words = f'v = {table.value} at row {table.row}, column {table.column}'
    text(image, words, (left, top + size[1] + 20), TRACKED_COLOUR, size=0.42)
