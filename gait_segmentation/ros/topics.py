# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Topics of the slots: ``person_0/box`` and so on, for the nodes, gait_demo and gait_replay.

Nothing here needs ROS.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeVar

from gait_segmentation.people import slot_name

__all__ = ['slot_topic', 'slot_topics']

Kind = TypeVar('Kind')


def slot_topic(slot: int, name: str) -> str:
    """Return the relative topic for one kind of output of a slot, such as ``box``."""
    return f'{slot_name(slot)}/{name}'


def slot_topics(kinds: Mapping[str, Kind], slots: int) -> dict[str, Kind]:
    """
    Return the message types of all slots by topic.

    :param kinds: those of one slot by name.
    :param slots: how many there are.
    """
    return {slot_topic(slot, name): kind for slot in range(slots) for name, kind in kinds.items()}
