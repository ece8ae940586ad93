# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How many people are looked after at a time."""

from __future__ import annotations

from dataclasses import dataclass

from gait_segmentation.config import StageConfig, parameter

__all__ = ['MOST_PEOPLE', 'PeopleConfig', 'slot_name']

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
    people_threads: int = parameter(
        2,
        'Threads among which matching and segmentation divide several people. The results '
        'do not depend on it.',
        minimum=1,
        maximum=MOST_PEOPLE,
        fixed=True,
    )


def slot_name(slot: int) -> str:
    """Return the name of a slot, a place for one tracked person at a time."""
    return f'person_{slot}'
