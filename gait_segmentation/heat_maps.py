# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Heat maps: where people are as others see it, such as a network."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import InputError

__all__ = ['HeatMap', 'HeatMaps', 'heat_map_of']

_MOST_KEPT = 16
"""Maps kept whose frames have not come."""


@dataclass(frozen=True)
class HeatMap:
    """Where people are as others see it: (h, w) uint8 of any size, and the stamp of its frame."""

    values: NDArray[np.uint8]
    stamp_ns: int


class HeatMaps:
    """The newest heat maps, which may come before their frames or after."""

    def __init__(self) -> None:
        """Begin without a map."""
        self._maps: deque[HeatMap] = deque(maxlen=_MOST_KEPT)

    def clear(self) -> None:
        """Forget all maps."""
        self._maps.clear()

    def add(self, heat_map: NDArray[Any], stamp_ns: int) -> None:
        """
        Take in a map; the array may be changed afterwards.

        :raises InputError: see :func:`heat_map_of`.
        """
        values = heat_map_of(heat_map)
        if np.shares_memory(values, heat_map):
            values = values.copy()
        self._maps.append(HeatMap(values, stamp_ns))

    def newest(self, stamp_ns: int, age_s: float) -> HeatMap | None:
        """
        Return the newest map up to a stamp, None if all are older than an age.

        :param age_s: in seconds; with 0 only the map of the very frame will do.
        """
        least = stamp_ns - round(age_s * 1e9)
        fitting = [each for each in self._maps if least <= each.stamp_ns <= stamp_ns]
        return max(fitting, key=lambda each: each.stamp_ns, default=None)


def heat_map_of(array: NDArray[Any]) -> NDArray[np.uint8]:
    """
    Return a heat map of any supported kind as (h, w) uint8, 255 = surely a person.

    :param array: (h, w), or (h, w, c) if all colours are equal (a fourth channel is opacity, which
        is ignored): uint8, uint16 or floating point numbers from 0 to 1.
    :raises InputError: if it has another shape or type, no pixel, or numbers that are not
        finite.
    """
    if not isinstance(array, np.ndarray):
        raise InputError(f'heat map must be an array, got {type(array).__name__}')
    if array.ndim == 3 and array.shape[2] in (1, 3, 4):
        if (array[..., :1] != array[..., : min(array.shape[2], 3)]).any():
            raise InputError('heat map must be grey, got colours')
        array = array[..., 0]
    if array.ndim != 2 or array.size == 0:
        raise InputError(f'heat map must be (height, width) with pixels, got {array.shape}')
    if array.dtype == np.uint16:
        array = (array >> 8).astype(np.uint8)
    if np.issubdtype(array.dtype, np.floating):
        if not np.isfinite(array).all():
            raise InputError('heat map must be of finite numbers, got NaN or infinity')
        least, most = float(array.min()), float(array.max())
        if least < 0 or most > 1:
            raise InputError(f'heat map must be from 0 to 1, got {least:g} to {most:g}')
        array = np.rint(255 * array).astype(np.uint8)
    if array.dtype != np.uint8:
        raise InputError(f'heat map must be of uint8, uint16 or floats, got {array.dtype}')
    return np.ascontiguousarray(array)
