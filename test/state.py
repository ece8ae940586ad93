# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What an object remembers, whatever its attributes are called."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterator
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
    return dict(_reached(value, '', frozenset(left_out), []))


def _reached(
    value: Any, way: str, left_out: frozenset[str], above: list[int]
) -> Iterator[tuple[str, Any]]:
    if isinstance(value, np.ndarray):
        yield way, (value.shape, str(value.dtype), value.tobytes())
    elif value is None or isinstance(value, bool | int | float | str | bytes | Enum | slice):
        yield way, repr(value)
    elif id(value) in above:
        yield way, 'above'
    else:
        for name, part in _parts(value, left_out):
            yield from _reached(part, f'{way}{name}', left_out, [*above, id(value)])
        yield f'{way}?', type(value).__name__


def _parts(value: Any, left_out: frozenset[str]) -> Iterator[tuple[str, Any]]:
    """Return the parts of a container, or the attributes of an object of the package."""
    kind = type(value)
    if isinstance(value, dict | Counter):
        yield from ((f'[{key!r}]', each) for key, each in value.items())
    elif isinstance(value, list | tuple | deque):
        yield from ((f'[{number}]', each) for number, each in enumerate(value))
    elif isinstance(value, set | frozenset):
        yield from ((f'[{number}]', each) for number, each in enumerate(sorted(value)))
    elif kind.__module__.startswith('gait_segmentation.'):
        for name, each in getattr(value, '__dict__', {}).items():
            # What is worked out when it is asked for is nothing new.
            if name not in left_out and not isinstance(getattr(kind, name, None), cached_property):
                yield f'.{name}', each


def differences(one: dict[str, Any], two: dict[str, Any]) -> list[str]:
    """Return the ways to what differs between two memories."""
    return sorted(way for way in {*one, *two} if one.get(way) != two.get(way))
