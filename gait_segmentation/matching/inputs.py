# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a matcher refuses."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import InputError
from gait_segmentation.images import check_stamp
from gait_segmentation.sizes import same_proportions

__all__ = ['check_frame']


def check_frame(
    likelihood: NDArray[np.uint8],
    stamp_ns: int,
    source_size: tuple[int, int],
    known: NDArray[np.uint8] | None,
    angle: float,
) -> float:
    """
    Refuse what cannot be used.

    The parameters are those of :meth:`SequenceMatcher.update`.

    :returns: the width of the likelihood over that of the source.
    :raises InputError: if a value cannot be used.
    """
    for name, array in (('likelihood', likelihood), ('known', known)):
        if array is None:
            continue
        if not isinstance(array, np.ndarray) or array.ndim != 2 or array.dtype != np.uint8:
            raise InputError(
                f'{name} must be a (height, width) uint8 array, got shape '
                f'{np.shape(array)} {getattr(array, "dtype", type(array).__name__)}'
            )
        if array.size == 0 or array.shape != likelihood.shape:
            raise InputError(
                f'{name} must have the size of the likelihood and at least one pixel, got '
                f'{array.shape} and {likelihood.shape}'
            )
    check_stamp(stamp_ns)
    if not math.isfinite(angle):
        raise InputError(f'angle must be a finite number of radians, got {angle}')
    width, height = source_size
    if width < 1 or height < 1:
        raise InputError(f'source size must be positive, got {width} x {height}')
    if not same_proportions(likelihood.shape, (height, width)):
        raise InputError(
            f'likelihood of {likelihood.shape[1]} x {likelihood.shape[0]} pixels does not '
            f'have the proportions of the source of {width} x {height}'
        )
    return likelihood.shape[1] / width
