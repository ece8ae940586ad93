# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of an evaluation: the masks as files, and a contact sheet of outlines."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.drawing import Colour, Image, track_colour
from gait_segmentation.files.output_files import write_picture, writing
from gait_segmentation.geometry import Box
from gait_segmentation.sheets import contact_sheet, spread, tile
from gait_tools.evaluation.metrics import true_box
from gait_tools.evaluation.runner import Outcome
from gait_tools.evaluation.sequence import Sequence
from gait_tools.evaluation.truth import PERSON

__all__ = ['SequenceOutput', 'outlines', 'write_image']

FOUND = track_colour(1)
"""Colour of the outline of the mask that was found."""

TRUE = (255, 90, 255)
"""Colour of the true outline."""


def write_image(path: Path, image: Image) -> None:
    """
    Write an image file, making its folder.

    :raises SequenceError: if it cannot be written.
    """
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
    write_picture(path, image)


def outlines(mask: Image, truth: NDArray[np.uint8] | None = None) -> list[tuple[Image, Colour]]:
    """Return what is to be outlined: what was found, over the truth if that is known."""
    person = [] if truth is None else [(np.where(truth == PERSON, 255, 0).astype(np.uint8), TRUE)]
    return [*person, (mask, FOUND)]


class SequenceOutput:
    """
    Writes what was found in a sequence: ``masks/NNNN.png`` and ``contact_sheet.png``.

    The sheet shows 28 frames spread evenly, or all if there are fewer.
    """

    def __init__(self, folder: Path, sequence: Sequence) -> None:
        """
        Begin.

        :param folder: where to write, made if it is missing.
        """
        self._folder, self._sequence = folder, sequence
        self.shown = spread(sequence.numbers)
        self._tiles: list[Image] = []
        self._box: Box | None = None

    def add(self, outcome: Outcome) -> None:
        """
        Write the mask of a frame and draw it if it is to be shown.

        :raises SequenceError: if a file cannot be read or written.
        """
        number, sequence = outcome.number, self._sequence
        write_image(self._folder / 'masks' / f'{sequence.frames[number].stem}.png', outcome.mask)
        if number not in self.shown:
            return
        image, truth = sequence.image(number), sequence.truth(number)
        box = None if truth is None else true_box(truth)
        self._box = box or outcome.box or self._box or Box(0, 0, image.shape[1], image.shape[0])
        words = f'{number:04d}'
        if outcome.score is not None:
            words += f'  J {outcome.score.j:.3f}'
        self._tiles.append(tile(image, self._box, outlines(outcome.mask, truth), words))

    def close(self) -> None:
        """
        Write the contact sheet.

        :raises SequenceError: if it cannot be written.
        """
        write_image(self._folder / 'contact_sheet.png', contact_sheet(self._tiles))
