# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A bank as one picture: a row for every sequence, a column for every phase shown."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import BankError
from gait_segmentation.gait_model.bank import TemplateBank

__all__ = ['contact_sheet']

_MARGIN = 96  # columns left of the templates for the labels
_HEADER = 16  # rows above them


def _text(image: NDArray[np.uint8], text: str, x: int, y: int) -> None:
    cv2.putText(image, text, (x, y), cv2.FONT_HERSHEY_SIMPLEX, 0.35, 200, 1, cv2.LINE_AA)


def contact_sheet(
    bank: TemplateBank, columns: int = 10, sequences: list[int] | None = None
) -> NDArray[np.uint8]:
    """
    Lay templates out on a sheet.

    :param bank: the bank.
    :param columns: phases to show, evenly spaced; at most all of them.
    :param sequences: indices of the sequences to show; all if None.
    :returns: (rows, columns) uint8, labelled with build, azimuth and phase.
    :raises BankError: for a sequence the bank has not, or fewer than one column.
    """
    if columns < 1:
        raise BankError(f'columns must be at least 1, got {columns}')
    chosen = list(range(bank.sequences)) if sequences is None else sequences
    wrong = [index for index in chosen if not 0 <= index < bank.sequences]
    if wrong or not chosen:
        raise BankError(f'sequences must be from 0 to {bank.sequences - 1}, got {wrong or "none"}')
    columns = min(columns, bank.phases)
    phases = [k * bank.phases // columns for k in range(columns)]
    height, width = bank.grid
    sheet = np.zeros((_HEADER + len(chosen) * height, _MARGIN + columns * width), dtype=np.uint8)
    for column, phase in enumerate(phases):
        _text(sheet, f'{phase / bank.phases:.2f}', _MARGIN + column * width + width // 3, 11)
    for row, sequence in enumerate(chosen):
        top = _HEADER + row * height
        _text(sheet, f'{sequence}', 4, top + height // 2 - 16)
        _text(sheet, bank.builds[sequence][:14], 4, top + height // 2)
        degrees = math.degrees(float(bank.azimuth[sequence]))
        _text(sheet, f'{degrees:.0f} deg', 4, top + height // 2 + 16)
        tiles = bank.templates[sequence, phases]
        sheet[top : top + height, _MARGIN:] = np.hstack(list(tiles))
    return sheet
