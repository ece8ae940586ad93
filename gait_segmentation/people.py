# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Several people: how many are tracked at a time."""

from __future__ import annotations

from dataclasses import dataclass

from gait_segmentation.config import StageConfig, parameter

MOST_PEOPLE = 16
"""Slots there can be."""


@dataclass(frozen=True)
class PeopleConfig(StageConfig):
    """What all stages must agree on."""

    max_people: int = parameter(
        1,
        'People tracked at a time (slots person_0, ...); the same for all nodes.',
        minimum=1,
        maximum=MOST_PEOPLE,
        fixed=True,
    )


def slot_name(slot: int) -> str:
    """Return the name of a slot, a place for one tracked person at a time."""
    return f'person_{slot}'
