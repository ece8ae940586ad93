# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A walker of the gait model before a calibrated camera, in metres, and errors of the place."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

import numba
import numpy as np
from numpy.typing import NDArray

from benchmarks.synthetic.scenery import make_panorama
from benchmarks.synthetic.walkers import make_outfit
from gait_segmentation.geometry import BodyFrame
from gait_segmentation.localization import CameraPose, Localizer, Location, PinholeCamera
from gait_segmentation.results import MatchResult
from gait_tools.gait_model.body import PARTS, Body, body_at, named_build

STATURE, STEP = 1.75, 0.70  # metres; the gait model's steps are 0.36 to 0.44 statures
WALL = 9.0  # metres ahead of the camera
RATE = 30.0

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Walk:
    """Where somebody is over the point below the camera: seconds -> x ahead, y left and yaw."""

    at: Callable[[float], tuple[float, float, float]]
    speed: float
    seconds: float


def _straight(x: float, y: float, yaw: float, speed: float, seconds: float) -> Walk:
    step = speed * math.cos(yaw), speed * math.sin(yaw)
    return Walk(lambda s: (x + s * step[0], y + s * step[1], yaw), speed, seconds)


def _arc(x: float, y: float, radius: float, speed: float, seconds: float) -> Walk:
    """From the far end of a circle about x, y to the left and towards the camera."""

    def at(s: float) -> tuple[float, float, float]:
        turn = s * speed / radius - 0.6
        return x + radius * math.cos(turn), y + radius * math.sin(turn), turn + math.pi / 2

    return Walk(at, speed, seconds)


PATHS = {
    'across': _straight(5.0, -2.2, math.pi / 2, 1.3, 3.4),
    'slanting': _straight(6.8, 1.6, -0.75 * math.pi, 1.1, 3.4),
    'arc': _arc(3.0, 0.0, 2.5, 1.2, 3.4),
}


@dataclass(frozen=True)
class Shot:
    """
    A frame and what is true of it.

    ``image`` (H, W, 3) uint8 BGR, ``mask`` (H, W) uint8 0/255, ``depth`` (H, W) float32 metres;
    ``body`` and ``azimuth`` are what a perfect match would say, ``position`` (3,) is the point on
    the ground below the pelvis in the camera's frame and ``yaw`` the heading in the ground's.
    """

    stamp_ns: int
    image: NDArray[np.uint8]
    mask: NDArray[np.uint8]
    depth: NDArray[np.float32]
    body: BodyFrame
    azimuth: float
    phase_rate: float
    position: Floats
    yaw: float
    speed: float


def film(
    walk: Walk, camera: PinholeCamera, pose: CameraPose, seed: int = 0, *, painted: bool = True
) -> Iterator[Shot]:
    """
    Yield the frames of a walk, as a standing camera without distortion sees them.

    :param painted: whether there are images, which take more than half of the time; else they
        are (0, 0, 3).
    """
    rng = np.random.default_rng(seed)
    shape = camera.height, camera.width
    focal, centre = (camera.fx, camera.fy), (camera.cx, camera.cy)
    directions = _directions()
    build, outfit = named_build('average'), make_outfit(rng)
    colours = np.array([outfit.colours[part] for part in PARTS], np.float32)
    cloth = 12 * rng.standard_normal((64, 64)).astype(np.float32)
    place, place_depth = _place(rng, camera, pose)
    rate = walk.speed / (2 * STEP)
    for number in range(round(walk.seconds * RATE)):
        seconds = number / RATE
        x, y, yaw = walk.at(seconds)
        surface, parts = _surface(body_at([rate * seconds % 1.0], build), directions)
        cos, sin = math.cos(yaw), math.sin(yaw)
        turn = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])
        foot = np.array([x, y, 0.0])
        corners = STATURE * surface.reshape(-1, 3) @ turn.T + foot
        points = ((corners - pose.position) @ pose.rotation).reshape(surface.shape)
        depth, label = _draw(points, parts, shape, *focal, *centre)
        seen = label >= 0
        image = np.zeros((0, 0, 3), np.uint8)
        if painted:
            rows, columns = np.nonzero(seen)
            rays = camera.rays(np.column_stack([columns + 0.5, rows + 0.5]))
            own = (rays * depth[seen][:, None]) @ pose.rotation.T + pose.position - foot
            own = np.floor(own @ turn / 0.04).astype(int) % 64
            colour = place.copy()
            shade = colours[label[seen]] + cloth[own[:, 2], own[:, 1]][:, None]
            colour[seen] = np.clip(shade, 0, 255).astype(np.uint8)
            noise = rng.normal(0, 2, (*shape, 1))
            image = np.clip(colour + noise, 0, 255).astype(np.uint8)
        ends = (np.array([[x, y, 0.0], [x, y, STATURE]]) - pose.position) @ pose.rotation
        (left, bottom), (right, top) = ends[:, :2] / ends[:, 2:] * focal + centre
        yield Shot(
            stamp_ns=1_000_000_000 + round(seconds * 1e9),
            image=image,
            mask=seen.astype(np.uint8) * np.uint8(255),
            depth=np.where(seen, depth, place_depth).astype(np.float32),
            body=BodyFrame(
                (left + right) / 2 + 0.5,
                (top + bottom) / 2 + 0.5,
                math.hypot(bottom - top, right - left),
                math.atan2(right - left, bottom - top),
            ),
            azimuth=_wrapped(yaw - math.atan2(y, x) + math.pi / 2),
            phase_rate=rate,
            position=ends[0],
            yaw=_wrapped(yaw),
            speed=walk.speed,
        )


def _wrapped(angle: float) -> float:
    return math.remainder(angle, 2 * math.pi)


def _directions() -> Floats:
    """Return unit vectors on a grid of latitudes and longitudes, (U, V, 3)."""
    up, round_ = np.linspace(0, np.pi, 13)[:, None], np.linspace(0, 2 * np.pi, 25)
    level = np.sin(up)
    grid = [level * np.cos(round_), level * np.sin(round_), np.cos(up) * np.ones_like(round_)]
    return np.stack(grid, axis=-1)


def _surface(body: Body, directions: Floats) -> tuple[Floats, NDArray[np.int64]]:
    """Return the triangles (T, 3, 3) of the body's pieces in statures, and the part of each."""
    centers, axes = body.centers[0], body.axes[0]
    found, parts = [], []
    for members, part in zip(body.pieces, body.parts, strict=True):
        tips = []
        for each in members:
            along = directions @ axes[each]
            length = np.maximum(np.linalg.norm(along, axis=-1, keepdims=True), 1e-12)
            tips.append(centers[each] + (along / length) @ axes[each].T)
        candidates = np.stack(tips)
        best = np.argmax((candidates * directions).sum(-1), axis=0)
        hull = np.take_along_axis(candidates, best[None, ..., None], axis=0)[0]
        a, b, c, d = hull[:-1, :-1], hull[1:, :-1], hull[1:, 1:], hull[:-1, 1:]
        for corners in ((a, b, c), (a, c, d)):
            found.append(np.stack(corners, axis=-2).reshape(-1, 3, 3))
            parts.append(np.full(len(found[-1]), part))
    return np.concatenate(found), np.concatenate(parts)


@numba.njit(cache=True)
def _draw(points, parts, shape, fx, fy, cx, cy):  # type: ignore[no-untyped-def]
    """Draw triangles (T, 3, 3) in the camera's frame: depth, and the part each pixel shows."""
    depth = np.full(shape, np.inf)
    label = np.full(shape, -1)
    for t in range(len(points)):
        z = points[t, :, 2]
        if z.min() <= 0.1:
            continue
        u, v = points[t, :, 0] / z * fx + cx, points[t, :, 1] / z * fy + cy
        area = (u[1] - u[0]) * (v[2] - v[0]) - (u[2] - u[0]) * (v[1] - v[0])
        if abs(area) < 1e-9:
            continue
        for row in range(max(0, math.ceil(v.min())), min(shape[0] - 1, math.floor(v.max())) + 1):
            left, right = max(0, math.ceil(u.min())), min(shape[1] - 1, math.floor(u.max()))
            for column in range(left, right + 1):
                first = (u[1] - column) * (v[2] - row) - (u[2] - column) * (v[1] - row)
                second = (u[2] - column) * (v[0] - row) - (u[0] - column) * (v[2] - row)
                p, q = first / area, second / area
                if p < 0 or q < 0 or p + q > 1:
                    continue
                near = 1 / (p / z[0] + q / z[1] + (1 - p - q) / z[2])
                if near < depth[row, column]:
                    depth[row, column], label[row, column] = near, parts[t]
    return depth, label


def _place(
    rng: np.random.Generator, camera: PinholeCamera, pose: CameraPose
) -> tuple[NDArray[np.float64], Floats]:
    """Return a picture of the ground and a wall, and their depth."""
    shape = camera.height, camera.width
    rows, columns = np.indices(shape)
    rays = (
        camera.rays(np.column_stack([columns.ravel() + 0.5, rows.ravel() + 0.5])) @ pose.rotation.T
    )
    with np.errstate(divide='ignore'):
        ground = np.where(rays[:, 2] < 0, -pose.position[2] / rays[:, 2], np.inf)
        wall = np.where(rays[:, 0] > 0, (WALL - pose.position[0]) / rays[:, 0], np.inf)
    depth = np.minimum(ground, wall).reshape(shape)
    foot = int(np.argmax(depth[:, shape[1] // 2] < wall.reshape(shape)[:, shape[1] // 2]))
    unit = camera.fy * STATURE / WALL
    return make_panorama(rng, shape, foot or shape[0], unit, 0.4).astype(float), depth


CAMERAS = {
    'level': (PinholeCamera(640, 480, 525, 525, 319.5, 239.5), CameraPose.above_ground(1.2)),
    'high': (
        PinholeCamera(640, 480, 460, 460, 319.5, 239.5),
        CameraPose.above_ground(2.2, math.radians(18)),
    ),
}
SETTLED = round(RATE)  # frames: one second

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
