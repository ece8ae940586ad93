# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
How ground truth is written in pixels, and reading it.

The *truth* of one person is (H, W) uint8: 255 the person, 0 background, anything else ambiguous.
*Labels* of several people are (H, W) uint8: 0 nobody, 1 to 16 one person each, anything else
ambiguous.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import SequenceError
from gait_segmentation.files.image_files import read_unchanged
from gait_segmentation.people import MOST_PEOPLE

__all__ = ['AMBIGUOUS', 'PERSON', 'UNCLEAR', 'labels_of_truth', 'read_mask', 'truth_of']

PERSON = 255
"""Value of the person in a mask."""

AMBIGUOUS = 170
"""Value this package writes for ambiguous pixels of a mask; it reads every other value so."""

UNCLEAR = 255
"""Value this package writes for ambiguous pixels of labels."""


def truth_of(labels: NDArray[np.uint8], person: int) -> NDArray[np.uint8]:
    """Return the truth of one person of some labels; other people are background."""
    table = np.zeros(256, np.uint8)
    table[MOST_PEOPLE + 1 :] = AMBIGUOUS
    table[person] = PERSON
    return table[labels]


def labels_of_truth(truth: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the labels of a truth with one person, who is 1."""
    table = np.full(256, UNCLEAR, np.uint8)
    table[0], table[PERSON] = 0, 1
    return table[truth]


def read_mask(path: Path, size: tuple[int, int]) -> NDArray[np.uint8]:
    """
    Read a single-channel image as (H, W) uint8, its values as they are.

    :param size: the width and height it must have.
    :raises SequenceError: if it cannot be read, has another size, colours or 16 bits.
    """
    mask = read_unchanged(path)
    if mask.ndim == 3 and (mask[..., :1] == mask[..., 1:3]).all():
        mask = np.ascontiguousarray(mask[..., 0])
    if mask.ndim != 2 or mask.dtype != np.uint8:
        raise SequenceError(
            f'{path} must be a grey image of 8 bits, got shape {mask.shape} of {mask.dtype}'
        )
    if mask.shape != (size[1], size[0]):
        raise SequenceError(
            f'{path} is {mask.shape[1]}x{mask.shape[0]}, but must be {size[0]}x{size[1]} '
            'like its frame'
        )
    return mask
