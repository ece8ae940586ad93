# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Paper to draw on: text, and plots with axes, by OpenCV."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import cv2
import numpy as np

from gait_segmentation.drawing import Colour, Image

__all__ = ['BLACK', 'BLUE', 'GREY', 'ORANGE', 'Plot', 'blank', 'text', 'text_width']

BLACK: Colour = (0, 0, 0)
GREY: Colour = (175, 175, 175)
BLUE: Colour = (180, 110, 30)
ORANGE: Colour = (30, 120, 240)

_FONT = cv2.FONT_HERSHEY_SIMPLEX
_SHIFT = 4


def blank(width: int, height: int) -> Image:
    """Return white paper."""
    return np.full((height, width, 3), 255, np.uint8)


def text_width(words: str, size: float = 0.45) -> int:
    """Return the width of a line of text in pixels."""
    return int(cv2.getTextSize(words, _FONT, size, 1)[0][0])


def text(
    image: Image,
    words: str,
    position: tuple[float, float],
    colour: Colour = BLACK,
    size: float = 0.45,
    anchor: float = 0.0,
) -> None:
    """
    Write a line of text.

    :param position: x and y of its baseline.
    :param anchor: where x lies in the line: 0 at its beginning, 1 at its end.
    """
    x = round(position[0] - anchor * text_width(words, size))
    cv2.putText(image, words, (x, round(position[1])), _FONT, size, colour, 1, cv2.LINE_AA)


@dataclass(frozen=True)
class Plot:
    """
    A rectangle of an image with two axes.

    ``area`` is left, top, right and bottom in pixels; ``x`` and ``y`` are the values at the ends
    of the axes.
    """

    image: Image
    area: tuple[int, int, int, int]
    x: tuple[float, float]
    y: tuple[float, float]

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Return where a pair of values lies, in pixels."""
        left, top, right, bottom = self.area
        across = (x - self.x[0]) / ((self.x[1] - self.x[0]) or 1.0)
        up = (y - self.y[0]) / ((self.y[1] - self.y[0]) or 1.0)
        return left + across * (right - left), bottom - up * (bottom - top)

    def axes(
        self, x_ticks: Iterable[float], y_ticks: Iterable[float], names: tuple[str, str]
    ) -> None:
        """Draw the frame, ticks with their values, and the names of x and y."""
        left, top, right, bottom = self.area
        cv2.line(self.image, (left, bottom), (right, bottom), BLACK, 1)
        cv2.line(self.image, (left, top), (left, bottom), BLACK, 1)
        for value in x_ticks:
            x = round(self.at(value, 0)[0])
            cv2.line(self.image, (x, bottom), (x, bottom + 4), BLACK, 1)
            text(self.image, f'{value:g}', (x, bottom + 18), size=0.4, anchor=0.5)
        for value in y_ticks:
            y = round(self.at(0, value)[1])
            cv2.line(self.image, (left - 4, y), (left, y), BLACK, 1)
            text(self.image, f'{value:g}', (left - 7, y + 4), size=0.4, anchor=1)
        text(self.image, names[0], ((left + right) / 2, bottom + 36), size=0.4, anchor=0.5)
        text(self.image, names[1], (left - 34, top - 10), size=0.4)

    def dots(self, points: Iterable[tuple[float, float]], colour: Colour, radius: float) -> None:
        """Draw a disk at each pair of values."""
        for point in points:
            x, y = (round(value * 2**_SHIFT) for value in self.at(*point))
            size = round(radius * 2**_SHIFT)
            cv2.circle(self.image, (x, y), size, colour, -1, cv2.LINE_AA, _SHIFT)

    def line(self, points: Iterable[tuple[float, float]], colour: Colour, width: int = 2) -> None:
        """Draw a line through pairs of values."""
        pixels = np.array([self.at(*point) for point in points]).reshape(-1, 1, 2)
        whole = np.rint(pixels * 2**_SHIFT).astype(np.int32)
        cv2.polylines(self.image, [whole], False, colour, width, cv2.LINE_AA, _SHIFT)
