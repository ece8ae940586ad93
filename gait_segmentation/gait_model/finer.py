# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The walkers of a bank in more directions, at a low resolution."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable

from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.gait_model.builder import BankSpec, model_name
from gait_segmentation.gait_model.cache import cached_bank

__all__ = ['DIRECTIONS', 'fine_grid', 'finer_bank']

DIRECTIONS = 64
"""From the front, views must lie this close for the phases to be told apart."""
_ROWS = 48
"""Outlines move by less than a row between phases, but all along their length."""
_FEWEST = 16  # columns of a bank


def fine_grid(bank: TemplateBank) -> tuple[int, int]:
    """Return the rows and columns of finer views of a bank: 48 rows of the same proportions."""
    height, width = bank.grid
    return _ROWS, max(round(_ROWS * width / height), _FEWEST)


def finer_bank(
    bank: TemplateBank, progress: Callable[[], None] | None = None
) -> TemplateBank | None:
    """
    Return a bank of the same builds, phases and share of the rows in 64 directions.

    It is kept in the cache as others are.

    :param progress: called after each sequence that is drawn.
    :returns: None if the bank is not of this version of the gait model.
    """
    if bank.provenance.get('model') != model_name():
        return None
    spec = BankSpec(**json.loads(bank.provenance['spec']))
    height, width = fine_grid(bank)
    return cached_bank(
        dataclasses.replace(spec, height=height, width=width, azimuths=DIRECTIONS, levels=256),
        progress,
    )
