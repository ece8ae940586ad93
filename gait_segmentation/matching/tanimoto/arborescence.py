# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The cheapest order in which templates can be made from each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.kernels import kernel

__all__ = ['minimum_arborescence']

_RUN = 512
"""Pixels that are compared before it is looked whether they are enough."""


def minimum_arborescence(
    pixels: NDArray[np.uint8],
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """
    Return a minimum spanning arborescence that starts at the empty template.

    The length of an edge is the number of pixels in which its two templates differ.  Equal
    templates, such as the half-cycle twins of a profile view, are neighbours at length 0.

    :param pixels: (K, N) uint8.
    :returns: order of the templates, parents first, and the parent of each template (by
        template, -1 = the empty one), both (K,) int64.  R. C. Prim, 1957.
    """
    return _prim(pixels)


@kernel('u1[:,::1]')
def _prim(pixels):  # type: ignore[no-untyped-def]
    count, size = pixels.shape
    distance = np.empty(count, np.int64)
    parent = np.full(count, -1, np.int64)
    order = np.empty(count, np.int64)
    done = np.zeros(count, np.bool_)
    for k in range(count):
        differ = 0
        for x in range(size):
            differ += pixels[k, x] != 0
        distance[k] = differ
    for place in range(count):
        nearest = -1
        for k in range(count):
            if not done[k] and (nearest < 0 or distance[k] < distance[nearest]):
                nearest = k
        done[nearest] = True
        order[place] = nearest
        for k in range(count):
            if not done[k]:
                differ = _differ(pixels[k], pixels[nearest], distance[k])
                if differ < distance[k]:
                    distance[k] = differ
                    parent[k] = nearest
    return order, parent


@kernel()
def _differ(one, other, limit):  # type: ignore[no-untyped-def]
    """Return in how many pixels two templates differ, or any number from a limit on if so many."""
    differ = np.int64(0)
    for first in range(0, len(one), _RUN):
        part, rest = one[first : first + _RUN], other[first : first + _RUN]
        # In numbers as small as this, many are counted at a time.
        found = np.int16(0)
        for x in range(len(part)):
            found = np.int16(found + np.int16(part[x] != rest[x]))
        differ += found
        if differ >= limit:
            break
    return differ
