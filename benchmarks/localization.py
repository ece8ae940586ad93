#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
How far off the localization is, on synthetic walkers before calibrated cameras.

Three walks, two cameras; by depth images with noise, and by the ground plane alone.  Masks and
matches come from the pipeline, which is given the first box, or are the true ones::

    python benchmarks/localization.py [--noise 0.01] [--true]

Per walk and camera: the median error of the place in metres, the largest error of the heading
from one second on in degrees, and the median error of the speed then in per cent.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.synthetic.perspective import PATHS, RATE, Shot, film
from gait_segmentation.geometry import Box
from gait_segmentation.kernels import compile_kernels
from gait_segmentation.localization import CameraPose, Localizer, Location, PinholeCamera
from gait_segmentation.pipeline import Pipeline
from gait_segmentation.results import MatchResult

CAMERAS = {
    'level': (PinholeCamera(640, 480, 525, 525, 319.5, 239.5), CameraPose.above_ground(1.2)),
    'high': (
        PinholeCamera(640, 480, 460, 460, 319.5, 239.5),
        CameraPose.above_ground(2.2, math.radians(18)),
    ),
}
SETTLED = RATE  # frames: one second

Found = tuple[Shot, MatchResult, NDArray[np.uint8]]


@dataclass
class Errors:
    """Errors of a walk, in metres, radians and shares, and how many frames had a place."""

    place: list[float] = field(default_factory=list)
    heading: list[float] = field(default_factory=list)
    speed: list[float] = field(default_factory=list)
    frames: int = 0

    def add(self, shot: Shot, found: Location | None, settled: bool) -> None:
        """Note a frame."""
        self.frames += 1
        if found is None:
            return
        self.place.append(float(np.linalg.norm(found.position - shot.position)))
        if settled:
            self.heading.append(abs(math.remainder(found.yaw - shot.yaw, 2 * math.pi)))
            self.speed.append(
                math.inf if found.speed is None else abs(found.speed / shot.speed - 1)
            )

    def __str__(self) -> str:
        """Return the line of the report."""
        if not self.heading:
            return 'nothing was located'
        return (
            f'{len(self.place):3d}/{self.frames} located, place {np.median(self.place):.3f} m, '
            f'heading {math.degrees(max(self.heading)):4.1f} deg at most, '
            f'speed {100 * np.median(self.speed):4.1f} %'
        )


def true_matches(shots: Sequence[Shot]) -> Iterator[Found]:
    """Yield the frames with the true mask and body."""
    black = np.zeros((1, 1), np.uint8)
    for shot in shots:
        walk = 0, 0, 0.0, shot.phase_rate, shot.azimuth, 1.0, 1.0, black
        yield shot, MatchResult(shot.stamp_ns, 1, shot.body, None, *walk), shot.mask


def found_matches(shots: Sequence[Shot]) -> Iterator[Found]:
    """Yield the frames with what the pipeline finds of them."""
    pipeline = Pipeline()
    first = Box.around(shots[0].mask)
    assert first is not None
    pipeline.initialize(first)
    waiting = {shot.stamp_ns: shot for shot in shots}
    results = [each for shot in shots for each in pipeline.update(shot.image, shot.stamp_ns)]
    for result in [*results, *pipeline.flush()]:
        person = result.people[0]
        yield waiting[result.stamp_ns], person.match, person.segmentation.mask


def locate(found: Sequence[Found], camera: str, noise: float | None, seed: int = 0) -> Errors:
    """Return the errors by depth with a share of noise, or by the ground alone without one."""
    model, pose = CAMERAS[camera]
    rng = np.random.default_rng(seed)
    localizer, errors = Localizer(), Errors()
    for number, (shot, match, mask) in enumerate(found):
        depth = None
        if noise is not None:
            factor = 1 + noise * rng.standard_normal(shot.depth.shape)
            depth = np.round(1000 * shot.depth * factor).clip(0, 65535).astype(np.uint16)
        (place,) = localizer.update([match], [mask], model, pose, depth)
        errors.add(shot, place, number >= SETTLED)
    return errors


def main() -> None:
    """Print the report."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('--noise', type=float, default=0.01, help='of depth, as a share of it')
    parser.add_argument('--true', action='store_true', help='true masks instead of the found')
    given = parser.parse_args()
    if not given.true:
        compile_kernels()
    for walk in PATHS:
        for camera, (model, pose) in CAMERAS.items():
            shots = list(film(PATHS[walk], model, pose))
            found = list((true_matches if given.true else found_matches)(shots))
            for name, noise in (('depth', given.noise), ('ground', None)):
                print(f'{walk:9} {camera:6} {name:7}', locate(found, camera, noise), flush=True)


if __name__ == '__main__':
    main()
