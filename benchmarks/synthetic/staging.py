# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Who and what is in a synthetic clip, and how its camera behaves, where no lots decide."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.synthetic.props import Prop
from benchmarks.synthetic.walkers import Walker

__all__ = ['Staging', 'still']


def still(number: int) -> tuple[float, float]:
    """Return that a frame is moved by nothing."""
    return 0.0, 0.0


def _even(number: int) -> float:
    return 1.0


@dataclass(frozen=True)
class Staging:
    """
    Who and what is in a clip in place of what the configuration's lots would draw.

    ``cast`` are all people (``walkers``, ``azimuth``, ``stride_rate`` and ``build`` of the
    configuration do not count then), ``props`` the things among them.  ``panorama`` makes the
    (H, W, 3) uint8 picture behind them from lots and its shape.  ``sway`` moves the picture of a
    frame by (x, y) pixels beside pan and jitter, ``exposure`` multiplies its brightness; ``grey``
    makes a grey camera: three equal channels.
    """

    cast: tuple[Walker, ...]
    props: tuple[Prop, ...] = ()
    panorama: Callable[[np.random.Generator, tuple[int, int]], NDArray[np.uint8]] | None = None
    sway: Callable[[int], tuple[float, float]] = still
    exposure: Callable[[int], float] = _even
    grey: bool = False
