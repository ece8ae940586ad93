# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Named synthetic scenes of what makes tracking hard, each a few seconds at 640 x 480.

Distances are in statures, and times in seconds from the first frame, unless said otherwise.  A
scene and a seed give the same bits.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import wraps
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.synthetic.camera import FOCAL_LENGTH
from benchmarks.synthetic.clothing import Outfit, make_disguise, make_outfit
from benchmarks.synthetic.config import Staging, SyntheticConfig
from benchmarks.synthetic.courses import Course
from benchmarks.synthetic.props import make_car, make_pillar, make_tree
from benchmarks.synthetic.scenery import make_boards, muted_colour
from benchmarks.synthetic.sequence import SyntheticSequence
from benchmarks.synthetic.walkers import Walker
from gait_segmentation.errors import InputError
from gait_tools.gait_model import FIGURES

__all__ = ['SCENES', 'scene']

_WIDTH, _HEIGHT, _FPS = 640, 480, 25.0

_FIGURES = tuple(name for name in FIGURES if name != 'rucksack')
"""Builds of the people; a rucksack would be drawn in one of few colours."""

_BOARDS = 18.0
"""How much lighter and darker the stripes of walls and disguises are."""

SCENES: dict[str, Callable[[int], SyntheticSequence]] = {}
"""Name -> what makes the scene from a seed; the docstrings describe them."""


class _Stage:
    """Collects a scene: its length, its people by lot, and where half way is."""

    def __init__(self, seed: int, salt: int, seconds: float, person_height: float) -> None:
        self.seed = seed
        self.rng = np.random.default_rng([seed, salt])
        self.config = SyntheticConfig(
            seed=100 * seed + salt,
            width=_WIDTH,
            height=_HEIGHT,
            fps=_FPS,
            frames=round(seconds * _FPS),
            person_height=person_height,
        )
        self.far = FOCAL_LENGTH * _WIDTH / person_height
        """Distance at which people are ``person_height`` tall."""
        self.begin = -(self.config.frames - 1) / 2 / _FPS
        """Time of the first frame in seconds after half way."""

    def person(
        self,
        *points: tuple[float, float],
        rate: float = 0.9,
        after: float = 0.0,
        stops: Mapping[int, float] | None = None,
        outfit: Outfit | None = None,
    ) -> Walker:
        """
        Send somebody through the scene.

        :param points: x, and z over :attr:`far`.
        :param rate: strides per second.
        :param after: when the first point is left.
        :param stops: index of a point -> seconds of standing there.
        """
        build = str(self.rng.choice(_FIGURES))
        drawn = make_outfit(self.rng, build)
        way = Course(
            points=tuple((x, z * self.far) for x, z in points),
            stride_rate=rate,
            phase=float(self.rng.uniform()),
            begins=self.begin + after,
            ends=-self.begin,
            stops=dict(stops or {}),
        )
        return Walker(way, 'average' if outfit else build, outfit or drawn)


def _scene(salt: int, seconds: float, person_height: float = 150.0) -> Callable[..., Any]:
    """Enter a function, which stages a scene, under its name."""

    def enter(stage_it: Callable[[_Stage], Staging]) -> Callable[[_Stage], Staging]:
        @wraps(stage_it)
        def make(seed: int) -> SyntheticSequence:
            stage = _Stage(seed, salt, seconds, person_height)
            return SyntheticSequence(stage.config, stage_it(stage))

        SCENES[stage_it.__name__.strip('_').replace('_', '-')] = make
        return stage_it

    return enter


def _panned(number: int) -> tuple[float, float]:
    return 60 * math.sin(2 * math.pi * number / (7 * _FPS)), 0.0


@_scene(1, 9.0, 140.0)
def _crossing(stage: _Stage) -> Staging:
    """Three people, each pair passing each other twice, all turning round; a panned camera."""
    cast = (
        stage.person((-1.6, 0.93), (1.4, 0.93), (-1.7, 0.93)),
        stage.person((1.5, 1.0), (-1.5, 1.01), (1.7, 1.0), rate=0.95),
        stage.person((0.3, 1.13), (-1.6, 1.12), (1.7, 1.13), rate=0.8),
    )
    return Staging(cast, sway=_panned)


@_scene(2, 5.0, 140.0)
def _overtaking(stage: _Stage) -> Staging:
    """Three people walking straight on: one meets two who overtake each other; panned camera."""
    cast = (
        stage.person((-1.7, 1.0), (3.0, 1.0)),
        stage.person((0.8, 0.9), (-3.0, 0.9), rate=0.65),
        stage.person((1.9, 1.12), (-3.0, 1.12), rate=1.05),
    )
    return Staging(cast, sway=_panned)


@_scene(3, 4.4)
def _pillar(stage: _Stage) -> Staging:
    """One person, wholly hidden by a pillar for 0.7 s."""
    walker = stage.person((-1.65, 1.0), (3.0, 1.0))
    return Staging((walker,), (make_pillar(stage.rng, 0.0, 0.85 * stage.far, 0.81),))


@_scene(4, 7.0)
def _exit_enter(stage: _Stage) -> Staging:
    """One person leaves to the right; a second later somebody else comes in from the left."""
    leaving = stage.person((0.4, 1.0), (4.0, 1.0))
    return Staging((leaving, stage.person((-2.8, 1.0), (4.0, 1.0), after=3.0)))


@_scene(5, 8.0)
def _exit_return(stage: _Stage) -> Staging:
    """One person leaves to the right, turns round out of sight and comes back."""
    return Staging((stage.person((0.4, 1.0), (3.0, 1.0), (-2.0, 0.98)),))


@_scene(6, 5.0, 140.0)
def _five(stage: _Stage) -> Staging:
    """Five people, nearer and farther, to the left and right."""
    cast = (
        stage.person((-1.7, 1.0), (3.0, 1.0)),
        stage.person((1.6, 0.88), (-3.0, 0.9), rate=0.85),
        stage.person((-0.9, 1.12), (3.0, 1.15), rate=0.8),
        stage.person((0.5, 1.25), (-3.0, 1.25)),
        stage.person((2.2, 1.4), (-3.0, 1.35), rate=0.95),
    )
    return Staging(cast)


def _disguised(stage: _Stage, wall: NDArray[np.float32], outfit: Outfit, relief: float) -> Staging:
    walker = stage.person((-1.5, 1.0), (3.0, 1.0), outfit=outfit)
    return Staging((walker,), panorama=lambda rng, shape: make_boards(rng, shape, wall, relief, 8))


@_scene(7, 4.0)
def _same_colour(stage: _Stage) -> Staging:
    """One person of the wall's two tones: upright stripes before level ones."""
    wall = muted_colour(np.random.default_rng([stage.seed, 7]), (0.1, 0.4), (0.4, 0.6))
    return _disguised(stage, wall, make_disguise(wall, _BOARDS, 14), _BOARDS)


@_scene(8, 4.0)
def _same_lightness(stage: _Stage) -> Staging:
    """One person exactly as light as the wall, but of another hue."""
    rng = np.random.default_rng([stage.seed, 8])
    turn, value = float(rng.uniform(0, 360)), float(rng.uniform(0.4, 0.5))
    wall, coat = (_hued(turn + by, 0.5, value) for by in (0.0, 150.0))
    coat = coat * (_lightness(wall) / _lightness(coat))
    return _disguised(stage, wall, make_disguise(coat, 0.0, 1), 0.0)


def _hued(degrees: float, saturation: float, value: float) -> NDArray[np.float32]:
    hsv = np.array([[[degrees % 360, saturation, value]]], np.float32)
    return np.asarray(cv2.cvtColor(hsv, cv2.COLOR_HSV2BGR)[0, 0] * 255)


def _lightness(colour: NDArray[np.float32]) -> float:
    return float(cv2.cvtColor(colour[None, None], cv2.COLOR_BGR2GRAY)[0, 0])


@_scene(9, 6.0)
def _standing(stage: _Stage) -> Staging:
    """One person stops, stands for 2.5 s and walks on."""
    return Staging((stage.person((-1.5, 1.0), (-0.2, 1.0), (3.0, 1.0), stops={1: 2.5}),))


@_scene(10, 5.6)
def _turning(stage: _Stage) -> Staging:
    """One person walks to the right, turns round and walks back."""
    return Staging((stage.person((-0.9, 1.0), (0.9, 1.0), (-2.0, 1.0)),))


@_scene(11, 6.0)
def _cars(stage: _Stage) -> Staging:
    """Cars pass behind the place where somebody comes in after 1.5 s."""
    walker = stage.person((-2.8, 1.0), (3.0, 1.0), after=0.5)
    cars = (
        make_car(stage.rng, 3.7, 1.25 * stage.far, 2.2),
        make_car(stage.rng, 2.0, 1.2 * stage.far, -2.8),
    )
    return Staging((walker,), cars)


@_scene(12, 6.0)
def _trees(stage: _Stage) -> Staging:
    """Trees swing in the wind; somebody comes in after 1.5 s."""
    walker = stage.person((-2.8, 1.0), (3.0, 1.0), after=0.5)
    trees = (
        make_tree(stage.rng, -1.2, 1.25 * stage.far),
        make_tree(stage.rng, 1.1, 1.2 * stage.far, swing=0.2, rate=0.8),
    )
    return Staging((walker,), trees)


@_scene(13, 4.4)
def _exposure(stage: _Stage) -> Staging:
    """The exposure jumps four times while somebody walks."""
    gains = ((0, 1.0), (25, 1.5), (45, 0.7), (65, 1.3), (85, 1.0))
    walker = stage.person((-1.65, 1.0), (3.0, 1.0))
    return Staging((walker,), exposure=lambda number: _last(gains, number)[0])


@_scene(14, 4.4)
def _shaken(stage: _Stage) -> Staging:
    """The camera is knocked by 40 px from one frame to the next, several times."""
    knocks = (
        *((0, 0.0, 0.0), (30, 40.0, 0.0), (31, 0.0, 0.0), (50, 24.0, 32.0)),
        *((70, -16.0, 32.0), (71, 24.0, 32.0), (90, 0.0, 0.0)),
    )
    walker = stage.person((-1.5, 1.0), (3.0, 1.0))
    return Staging((walker,), sway=lambda number: _last(knocks, number))


def _last(changes: Sequence[tuple[Any, ...]], number: int) -> Any:
    """Return what changed last, given (frame, values...) in order."""
    return next(values for frame, *values in reversed(changes) if number >= frame)


@_scene(15, 4.4)
def _grey(stage: _Stage) -> Staging:
    """Two people pass each other before a grey camera."""
    cast = (
        stage.person((-1.6, 1.0), (3.0, 1.0)),
        stage.person((1.6, 1.12), (-3.0, 1.12)),
    )
    return Staging(cast, grey=True)


def scene(name: str, seed: int = 0) -> SyntheticSequence:
    """
    Make a scene.

    :param name: one of :data:`SCENES`.
    :raises InputError: if there is no such scene.
    """
    if name not in SCENES:
        raise InputError(f'a scene must be one of {", ".join(SCENES)}, got {name!r}')
    return SCENES[name](seed)
