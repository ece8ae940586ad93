# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What ``sequence.yaml`` says of a sequence: its rate, and where people are at first."""

from __future__ import annotations

import sys
from collections.abc import Container
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gait_segmentation.errors import InputError, SequenceError
from gait_segmentation.files.reading import read_yaml
from gait_segmentation.geometry import Box, check_start_box

__all__ = ['Description']


@dataclass(frozen=True)
class Description:
    """
    The names and values of a ``sequence.yaml``, checked when they are asked for.

    Errors are :class:`SequenceError` and name the file, the value and what is allowed.
    """

    path: Path
    values: dict[str, Any]

    @classmethod
    def read(cls, path: Path) -> Description:
        """
        Read a file.

        :raises SequenceError: if it cannot be read, or does not hold names and values.
        """
        values = read_yaml(path, SequenceError)
        if not isinstance(values, dict):
            raise SequenceError(f'{path} must have names and values (fps, initial_box ...)')
        return cls(path, values)

    @property
    def has_all_boxes(self) -> bool:
        """Return whether there are boxes of everybody who is to be tracked."""
        return 'initial_boxes' in self.values

    def fps(self) -> float:
        """
        Return the frames per second.

        :raises SequenceError: if there is no positive number.
        """
        if 'fps' not in self.values:
            raise SequenceError(f'{self.path} has no fps')
        value = self.values['fps']
        if not _finite(value):
            raise SequenceError(f'fps in {self.path} must be a number, got {value!r}')
        if value <= 0:
            raise SequenceError(f'fps in {self.path} must be positive, got {value:g}')
        return float(value)

    def initial_frame(self, frames: dict[int, Path]) -> int:
        """
        Return the number of the frame that ``initial_box`` belongs to, 0 if it is not given.

        :param frames: those there are, by number.
        :raises SequenceError: if it is none of them.
        """
        first = self.values.get('initial_frame', 0)
        if not _is_number(first) or first not in frames:
            raise SequenceError(
                f'initial_frame in {self.path} must be the number of a frame '
                f'({min(frames)} to {max(frames)}), got {first!r}'
            )
        return int(first)

    def boxes(
        self, frames: dict[int, Path], size: tuple[int, int], *, needed: bool
    ) -> dict[int, tuple[Box, ...]]:
        """
        Return the boxes that start tracks, by the number of their frame.

        :param frames: those there are, by number.
        :param size: their width and height.
        :param needed: whether there must be an ``initial_box``.
        :raises SequenceError: if one cannot be used or is missing.
        """
        first = self.initial_frame(frames)
        given: dict[int, tuple[Box, ...]] = {}
        if 'initial_box' in self.values:
            given[first] = (self._box('initial_box', self.values['initial_box'], size),)
        elif needed:
            raise SequenceError(f'{self.path} has no initial_box')
        return self._all_boxes(first, frames, size) if self.has_all_boxes else given

    def _all_boxes(
        self, first: int, frames: Container[int], size: tuple[int, int]
    ) -> dict[int, tuple[Box, ...]]:
        entries = self.values['initial_boxes']
        if not (isinstance(entries, list) and entries):
            raise SequenceError(
                f'initial_boxes in {self.path} must be a list of boxes, got {entries!r}'
            )
        boxes: dict[int, tuple[Box, ...]] = {}
        for entry in entries:
            number, values = first, entry
            if isinstance(entry, dict):
                number, values = entry.get('frame', first), entry.get('box')
            if not _is_number(number) or number not in frames or number < first:
                raise SequenceError(
                    f'a frame of initial_boxes in {self.path} must be the number of a frame from '
                    f'{first} on, got {number!r}'
                )
            box = self._box('a box of initial_boxes', values, size)
            boxes[number] = (*boxes.get(number, ()), box)
        return dict(sorted(boxes.items()))

    def _box(self, name: str, values: Any, size: tuple[int, int]) -> Box:
        about = f'{name} in {self.path} must'
        if not (isinstance(values, list) and len(values) == 4 and all(map(_finite, values))):
            raise SequenceError(f'{about} be four numbers x, y, width, height, got {values!r}')
        if values[2] <= 0 or values[3] <= 0:
            raise SequenceError(f'{about} have a positive width and height, got {values}')
        box = Box(*map(float, values))
        if box.clipped(*size) is None:
            raise SequenceError(f'{about} overlap the image of {size[0]}x{size[1]}, got {values}')
        try:
            check_start_box(box, size)
        except InputError as error:
            raise SequenceError(f'{name} in {self.path}: {error}') from error
        return box


def _finite(value: Any) -> bool:
    # Compared, since integers may be larger than any float.
    return _is_number(value) and abs(value) <= sys.float_info.max


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
