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

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.synthetic.camera import FOCAL_LENGTH
from benchmarks.synthetic.clothing import Outfit, make_disguise, make_outfit
from benchmarks.synthetic.config import SyntheticConfig
from benchmarks.synthetic.courses import Course
from benchmarks.synthetic.props import Prop, make_car, make_pillar, make_tree
from benchmarks.synthetic.scenery import make_boards, muted_colour
from benchmarks.synthetic.sequence import SyntheticSequence
from benchmarks.synthetic.staging import Staging
from benchmarks.synthetic.walkers import Walker
from gait_segmentation.errors import InputError
from gait_segmentation.gait_model import FIGURES

__all__ = ['SCENES', 'scene']

_WIDTH, _HEIGHT, _FPS = 640, 480, 25.0

_FIGURES = tuple(name for name in FIGURES if name != 'rucksack')
"""Builds of the people; a rucksack would be drawn in one of few colours."""

_BOARDS = 18.0
"""How much lighter and darker the stripes of walls and disguises are."""


class _Stage:
    """Collects a scene: its length, its people by lot, and where half way is."""

    def __init__(self, seed: int, salt: int, seconds: float, person_height: float = 150.0) -> None:
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
        points: Sequence[tuple[float, float]],
        *,
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

    def play(self, *cast: Walker, props: tuple[Prop, ...] = ()) -> SyntheticSequence:
        """Put people and things before a wall by lot."""
        return SyntheticSequence(self.config, Staging(cast, props))


def _crossing(seed: int) -> SyntheticSequence:
    """Three people, each pair passing each other twice, all turning round; a panned camera."""
    stage = _Stage(seed, 1, 9.0, 140.0)
    cast = (
        stage.person([(-1.6, 0.93), (1.4, 0.93), (-1.7, 0.93)], rate=0.9),
        stage.person([(1.5, 1.0), (-1.5, 1.01), (1.7, 1.0)], rate=0.95),
        stage.person([(0.3, 1.13), (-1.6, 1.12), (1.7, 1.13)], rate=0.8),
    )
    return SyntheticSequence(stage.config, Staging(cast, sway=_panned))


def _overtaking(seed: int) -> SyntheticSequence:
    """Three people walking straight on: one meets two who overtake each other; panned camera."""
    stage = _Stage(seed, 2, 5.0, 140.0)
    cast = (
        stage.person([(-1.7, 1.0), (3.0, 1.0)], rate=0.9),
        stage.person([(0.8, 0.9), (-3.0, 0.9)], rate=0.65),
        stage.person([(1.9, 1.12), (-3.0, 1.12)], rate=1.05),
    )
    return SyntheticSequence(stage.config, Staging(cast, sway=_panned))


def _panned(number: int) -> tuple[float, float]:
    return 60 * math.sin(2 * math.pi * number / (7 * _FPS)), 0.0


def _pillar(seed: int) -> SyntheticSequence:
    """One person, wholly hidden by a pillar for 0.7 s."""
    stage = _Stage(seed, 3, 4.4)
    walker = stage.person([(-1.65, 1.0), (3.0, 1.0)])
    return stage.play(walker, props=(make_pillar(stage.rng, 0.0, 0.85 * stage.far, 0.81),))


def _exit_enter(seed: int) -> SyntheticSequence:
    """One person leaves to the right; a second later somebody else comes in from the left."""
    stage = _Stage(seed, 4, 7.0)
    return stage.play(
        stage.person([(0.4, 1.0), (4.0, 1.0)]),
        stage.person([(-2.8, 1.0), (4.0, 1.0)], after=3.0),
    )


def _exit_return(seed: int) -> SyntheticSequence:
    """One person leaves to the right, turns round out of sight and comes back."""
    stage = _Stage(seed, 5, 8.0)
    return stage.play(stage.person([(0.4, 1.0), (3.0, 1.0), (-2.0, 0.98)]))


def _five(seed: int) -> SyntheticSequence:
    """Five people, nearer and farther, to the left and right."""
    stage = _Stage(seed, 6, 5.0, 140.0)
    return stage.play(
        stage.person([(-1.7, 1.0), (3.0, 1.0)], rate=0.9),
        stage.person([(1.6, 0.88), (-3.0, 0.9)], rate=0.85),
        stage.person([(-0.9, 1.12), (3.0, 1.15)], rate=0.8),
        stage.person([(0.5, 1.25), (-3.0, 1.25)], rate=0.9),
        stage.person([(2.2, 1.4), (-3.0, 1.35)], rate=0.95),
    )


def _disguised(
    seed: int, salt: int, wall: NDArray[np.float32], outfit: Outfit, relief: float
) -> SyntheticSequence:
    stage = _Stage(seed, salt, 4.0)
    walker = stage.person([(-1.5, 1.0), (3.0, 1.0)], outfit=outfit)
    staging = Staging(
        (walker,), panorama=lambda rng, shape: make_boards(rng, shape, wall, relief, 8)
    )
    return SyntheticSequence(stage.config, staging)


def _same_colour(seed: int) -> SyntheticSequence:
    """One person of the wall's two tones: upright stripes before level ones."""
    wall = muted_colour(np.random.default_rng([seed, 7]), (0.1, 0.4), (0.4, 0.6))
    return _disguised(seed, 7, wall, make_disguise(wall, _BOARDS, 14), _BOARDS)


def _same_lightness(seed: int) -> SyntheticSequence:
    """One person exactly as light as the wall, but of another hue."""
    rng = np.random.default_rng([seed, 8])
    turn, value = float(rng.uniform(0, 360)), float(rng.uniform(0.4, 0.5))
    wall, coat = (_hued(turn + by, 0.5, value) for by in (0.0, 150.0))
    coat = coat * (_lightness(wall) / _lightness(coat))
    return _disguised(seed, 8, wall, make_disguise(coat, 0.0, 1), 0.0)


def _hued(degrees: float, saturation: float, value: float) -> NDArray[np.float32]:
    hsv = np.array([[[degrees % 360, saturation, value]]], np.float32)
    return np.asarray(cv2.cvtColor(hsv, cv2.COLOR_HSV2BGR)[0, 0] * 255)


def _lightness(colour: NDArray[np.float32]) -> float:
    return float(cv2.cvtColor(colour[None, None], cv2.COLOR_BGR2GRAY)[0, 0])


def _standing(seed: int) -> SyntheticSequence:
    """One person stops, stands for 2.5 s and walks on."""
    stage = _Stage(seed, 9, 6.0)
    return stage.play(stage.person([(-1.5, 1.0), (-0.2, 1.0), (3.0, 1.0)], stops={1: 2.5}))


def _turning(seed: int) -> SyntheticSequence:
    """One person walks to the right, turns round and walks back."""
    stage = _Stage(seed, 10, 5.6)
    return stage.play(stage.person([(-0.9, 1.0), (0.9, 1.0), (-2.0, 1.0)]))


def _cars(seed: int) -> SyntheticSequence:
    """Cars pass behind the place where somebody comes in after 1.5 s."""
    stage = _Stage(seed, 11, 6.0)
    walker = stage.person([(-2.8, 1.0), (3.0, 1.0)], after=0.5)
    cars = (
        make_car(stage.rng, 3.7, 1.25 * stage.far, 2.2),
        make_car(stage.rng, 2.0, 1.2 * stage.far, -2.8),
    )
    return stage.play(walker, props=cars)


def _trees(seed: int) -> SyntheticSequence:
    """Trees swing in the wind; somebody comes in after 1.5 s."""
    stage = _Stage(seed, 12, 6.0)
    walker = stage.person([(-2.8, 1.0), (3.0, 1.0)], after=0.5)
    trees = (
        make_tree(stage.rng, -1.2, 1.25 * stage.far),
        make_tree(stage.rng, 1.1, 1.2 * stage.far, swing=0.2, rate=0.8),
    )
    return stage.play(walker, props=trees)


def _exposure(seed: int) -> SyntheticSequence:
    """The exposure jumps four times while somebody walks."""
    stage = _Stage(seed, 13, 4.4)
    gains = ((85, 1.0), (65, 1.3), (45, 0.7), (25, 1.5))

    def exposure(number: int) -> float:
        return next((gain for frame, gain in gains if number >= frame), 1.0)

    walker = stage.person([(-1.65, 1.0), (3.0, 1.0)])
    return SyntheticSequence(stage.config, Staging((walker,), exposure=exposure))


def _shaken(seed: int) -> SyntheticSequence:
    """The camera is knocked by 40 px from one frame to the next, several times."""
    stage = _Stage(seed, 14, 4.4)
    knocks = ((30, 40, 0), (31, 0, 0), (50, 24, 32), (70, -16, 32), (71, 24, 32), (90, 0, 0))

    def sway(number: int) -> tuple[float, float]:
        return next(((x, y) for frame, x, y in reversed(knocks) if number >= frame), (0.0, 0.0))

    walker = stage.person([(-1.5, 1.0), (3.0, 1.0)])
    return SyntheticSequence(stage.config, Staging((walker,), sway=sway))


def _grey(seed: int) -> SyntheticSequence:
    """Two people pass each other before a grey camera."""
    stage = _Stage(seed, 15, 4.4)
    cast = (
        stage.person([(-1.6, 1.0), (3.0, 1.0)]),
        stage.person([(1.6, 1.12), (-3.0, 1.12)]),
    )
    return SyntheticSequence(stage.config, Staging(cast, grey=True))


SCENES: Mapping[str, Callable[[int], SyntheticSequence]] = {
    'crossing': _crossing,
    'overtaking': _overtaking,
    'pillar': _pillar,
    'exit-enter': _exit_enter,
    'exit-return': _exit_return,
    'five': _five,
    'same-colour': _same_colour,
    'same-lightness': _same_lightness,
    'standing': _standing,
    'turning': _turning,
    'cars': _cars,
    'trees': _trees,
    'exposure': _exposure,
    'shaken': _shaken,
    'grey': _grey,
}
"""Name -> what makes the scene from a seed; the docstrings describe them."""


def scene(name: str, seed: int = 0) -> SyntheticSequence:
    """
    Make a scene.

    :param name: one of :data:`SCENES`.
    :raises InputError: if there is no such scene.
    """
    if name not in SCENES:
        raise InputError(f'a scene must be one of {", ".join(SCENES)}, got {name!r}')
    return SCENES[name](seed)
