# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What an object remembers, whatever its attributes are called."""

from __future__ import annotations

from collections import deque
from enum import Enum
from functools import cached_property
from typing import Any

import numpy as np


def remembered(value: Any, *left_out: str) -> dict[str, Any]:
    """
    Return all that can be reached from an object of the package, by its way there.

    Of what is not the package's, such as locks and counters of ids, only the type is told.

    :param left_out: names of attributes that do not count, at any depth.
    """
    found: dict[str, Any] = {}

    def reach(each: Any, way: str, above: tuple[int, ...]) -> None:
        kind, parts = type(each), {}
        if isinstance(each, np.ndarray):
            found[way] = each.shape, str(each.dtype), each.tobytes()
            return
        if each is None or isinstance(each, bool | int | float | str | bytes | Enum | slice):
            found[way] = repr(each)
            return
        if isinstance(each, dict):
            parts = {f'[{key!r}]': part for key, part in each.items()}
        elif isinstance(each, list | tuple | deque | set):
            ordered = sorted(each) if isinstance(each, set) else each
            parts = {f'[{number}]': part for number, part in enumerate(ordered)}
        elif kind.__module__.startswith('gait_segmentation.'):
            # What is worked out when it is asked for is nothing new.
            parts = {
                f'.{name}': part
                for name, part in getattr(each, '__dict__', {}).items()
                if name not in left_out and not isinstance(vars(kind).get(name), cached_property)
            }
        found[f'{way}?'] = kind.__name__
        if id(each) not in above:
            for name, part in parts.items():
                reach(part, way + name, (*above, id(each)))

    reach(value, '', ())
    return found


def differences(one: dict[str, Any], two: dict[str, Any]) -> list[str]:
    """Return the ways to what differs between two memories."""
    return sorted(way for way in {*one, *two} if one.get(way) != two.get(way))
