# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
How ground truth is written in pixels.

The *truth* of one person is (H, W) uint8: 255 the person, 0 background, anything else ambiguous.
*Labels* of several people are (H, W) uint8: 0 nobody, 1 to 16 one person each, anything else
ambiguous.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.people import MOST_PEOPLE

__all__ = ['AMBIGUOUS', 'PERSON', 'UNCLEAR', 'labels_of_truth', 'truth_of']

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
