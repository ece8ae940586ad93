# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What can be chosen about a synthetic clip."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.synthetic.props import Prop
from benchmarks.synthetic.walkers import Walker

__all__ = ['Staging', 'SyntheticConfig', 'still']


@dataclass(frozen=True)
class SyntheticConfig:
    """
    Parameters of a clip; sizes in pixels, deviations are standard deviations.

    ``person_height`` is that of the first walker half way, who walks towards ``azimuth`` (radians:
    0 right, pi/2 away, -pi/2 closer) with ``stride_rate`` strides (two steps) a second; ``pan`` is
    how far the camera moves to the right a frame, seen on that walker.
    """

    seed: int = 0
    width: int = 320
    height: int = 240
    fps: float = 25.0
    frames: int = 50
    person_height: float = 120.0
    azimuth: float = 0.0
    stride_rate: float = 0.9
    build: str = 'average'
    walkers: int = 1
    pan: float = 0.0
    jitter: float = 0.3
    """Deviation of the camera's shake."""

    clutter: float = 0.5
    """Things before the wall: 0 none, 1 crowded."""

    shadow: bool = False
    """Whether walkers cast soft shadows."""

    noise: float = 3.0
    """Deviation of the sensor's noise, grey levels."""

    blur: float = 0.5
    """Deviation of the lens's blur."""


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
