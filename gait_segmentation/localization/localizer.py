# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""From masks, matched templates and a calibrated camera to places, headings and speeds."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import InputError
from gait_segmentation.geometry import BodyFrame, check_body
from gait_segmentation.localization.camera import (
    CameraPose,
    DepthImage,
    DoubleArray,
    PinholeCamera,
    distance_by_depth,
)
from gait_segmentation.localization.config import LocalizationConfig
from gait_segmentation.results import MatchResult

DEPTH, GROUND, PREDICTED = 'depth', 'ground', 'predicted'
"""Where a place comes from."""

_WATCHED_S = 0.5  # time of a track, about a step, before it has a speed
# Standard deviation that every place has at least, whatever is said to be exact.
_LEAST_ERROR_M = 1e-3
# Within this of straight below (or above) the camera the direction to a person is unknown.
_BELOW = math.sin(math.radians(5))
_FARTHEST_M = 1e4  # distance beyond which a place is none
_FASTEST_M_S = 4.5  # speed above that of walkers
_STEPS = (0.05, 0.9)  # lengths of the steps of walkers, in statures
_STRIDES_HZ = (0.2, 2.5)  # rates of the strides of walkers


@dataclass(frozen=True)
class Location:
    """
    Where a person stands and how they walk; vectors are in the camera's frame, in metres.

    ``position`` (3,) is the point on the ground below the body, with its ``covariance`` (3, 3).
    ``heading`` and ``up`` (3,) have length 1: the horizontal walking direction, with the standard
    deviation ``heading_error`` in radians, and away from the ground.  ``yaw`` is the heading's
    angle about ``up`` in radians, in the ground's frame.  ``speed`` in m/s and ``step_length`` are
    None until the person was watched for half a second, and where they are those of no walker; so
    is the step length without cadence.  ``distance`` is that on the ground from the point below
    the camera, or, where neither height nor tilt of the camera is known, along its optical axis.
    ``source`` is one of :data:`DEPTH`, :data:`GROUND` and :data:`PREDICTED`.
    """

    track_id: int
    position: DoubleArray
    covariance: DoubleArray
    heading: DoubleArray
    up: DoubleArray
    yaw: float
    heading_error: float
    speed: float | None
    step_length: float | None
    stature: float
    distance: float
    source: str

    @cached_property
    def orientation(self) -> tuple[float, float, float, float]:
        """Return the quaternion x, y, z, w whose axes are heading, to the left, and up."""
        axes = np.column_stack([self.heading, np.cross(self.up, self.heading), self.up])
        vector = cv2.Rodrigues(axes)[0].ravel()
        angle = float(np.linalg.norm(vector))
        x, y, z = (vector * (math.sin(angle / 2) / angle if angle else 0.5)).tolist()
        return x, y, z, math.cos(angle / 2)


class _Place(NamedTuple):
    """When and where a person was, in the ground's frame, with covariance and source."""

    time_s: float
    at: DoubleArray
    covariance: DoubleArray
    source: str


_Track = deque[_Place]


class _Motion(NamedTuple):
    """The last place, the velocity (2,) then with its covariance, and the speed."""

    last: _Place
    velocity: DoubleArray
    covariance: DoubleArray
    speed: float


class _View(NamedTuple):
    """How a body is seen: rays to its middle and its soles (z of the camera 1), turned to z up."""

    time_s: float
    body: BodyFrame
    camera: PinholeCamera
    pose: CameraPose
    middle: DoubleArray
    soles: DoubleArray

    @classmethod
    def of(cls, match: MatchResult, camera: PinholeCamera, pose: CameraPose) -> _View:
        assert match.body is not None
        body = match.body
        ends = np.array([(body.center_x, body.center_y), body.feet])
        rays = camera.rays(ends) @ pose.rotation.T
        if math.hypot(*rays[0, :2]) < _BELOW * np.linalg.norm(rays[0]):
            raise InputError('straight below or above the camera')
        return cls(match.stamp_ns * 1e-9, body, camera, pose, *rays)

    @property
    def away(self) -> DoubleArray:
        """Return the horizontal direction (2,) from the camera to the body."""
        return self.middle[:2] / math.hypot(*self.middle[:2])

    def place(
        self, towards: DoubleArray, distance: float, errors: tuple[float, float], source: str
    ) -> _Place:
        """Return the place at a distance over the ground; errors are in pixels and metres."""
        angle = errors[0] / self.camera.fy
        level = self.pose.position[:2] + distance * towards
        z = 0.0
        if not self.pose.grounded:
            z = self.pose.position[2] + self.soles[2] * distance / (self.soles[:2] @ towards)
        axes = np.array([[*towards, 0], [-towards[1], towards[0], 0], [0, 0, 1]])
        spread = np.square(
            np.maximum([errors[1], angle * distance, angle * distance], _LEAST_ERROR_M)
        )
        covariance = axes.T @ np.diag(spread) @ axes
        return _Place(self.time_s, np.array([*level, z]), covariance, source)


class Localizer:
    """Locates people frame by frame; remembers the places of each track for its velocity."""

    def __init__(self, config: LocalizationConfig | None = None) -> None:
        self.config = config or LocalizationConfig()
        self.failures = 0
        """People that could not be located because of an error that nothing here provides for."""

        self.reset()

    def reset(self) -> None:
        """Drop all tracks."""
        self._tracks: dict[int, _Track] = {}
        self.reasons: tuple[str, ...] = ()
        """Why people of the last frame are not located, one a slot; empty if they are."""

    def update(
        self,
        matches: Sequence[MatchResult],
        masks: Sequence[NDArray[np.uint8]],
        camera: PinholeCamera,
        pose: CameraPose | None = None,
        depth: DepthImage | None = None,
    ) -> tuple[Location | None, ...]:
        """
        Locate the people of a frame.

        :param matches: one a slot, of which body, track id, azimuth and phase rate are used.
        :param masks: one a slot, (H, W) uint8, not zero = person.
        :param pose: where the camera is over the ground in this frame; None = as configured.
        :param depth: (H, W), registered to the image, along the camera's z:
            uint16 in millimetres or float32 in metres.
        :returns: one a slot, None where there is no person or no location: then
            :attr:`reasons` say why.
        :raises InputError: if the camera is of images of another size.
        """
        if pose is None:
            config = self.config
            pose = CameraPose.above_ground(config.camera_height, math.radians(config.camera_pitch))
        found: list[Location | None] = []
        reasons = []
        for match, mask in zip(matches, masks, strict=True):
            camera.check_size(mask.shape)
            place, why = None, ''
            try:
                place = self._locate(match, mask, camera, pose, depth)
            except InputError as error:
                why = str(error)
            except (ArithmeticError, ValueError, cv2.error) as error:
                # Of numbers that no door has refused; they are not to spoil what comes.
                why = f'{type(error).__name__}: {error}'
                self.failures += 1
                self._tracks.pop(match.track_id, None)
            found.append(place)
            reasons.append(why)
        self.reasons = tuple(reasons)
        now = {match.track_id for match in matches}
        self._tracks = {each: walk for each, walk in self._tracks.items() if each in now}
        return tuple(found)

    def _locate(
        self,
        match: MatchResult,
        mask: NDArray[np.uint8],
        camera: PinholeCamera,
        pose: CameraPose,
        depth: DepthImage | None,
    ) -> Location | None:
        """Locate a person, None if there is none; InputError says why it cannot be done."""
        if match.body is None or not match.track_id:
            return None
        check_body(match.body, (mask.shape[1], mask.shape[0]))
        view = _View.of(match, camera, pose)
        walk = self._tracks.setdefault(match.track_id, deque())
        if walk and walk[-1].time_s >= view.time_s:
            walk.clear()
        while walk and view.time_s - walk[0].time_s > self.config.window:
            walk.popleft()
        place, why = None, []
        if depth is not None:
            try:
                place = self._by_depth(view, mask, depth)
            except InputError as error:
                why.append(str(error))
        place = place or self._predicted(walk, view.time_s)
        if place is None and (pose.grounded or not why):
            try:
                place = self._on_ground(view)
            except InputError as error:
                why.append(str(error))
        if place is None:
            raise InputError(', and '.join(why))
        walk.append(place)
        motion = self._motion(walk, DEPTH if place.source == PREDICTED else place.source)
        return self._location(match, view, place, motion)

    def _by_depth(self, view: _View, mask: NDArray[np.uint8], depth: DepthImage) -> _Place:
        config, away = self.config, view.away
        seen = distance_by_depth(depth, mask, view.camera, view.pose, away, config.max_distance)
        # Without the ground the soles say how low it is.
        if not (view.pose.grounded or view.soles[:2] @ away > 0):
            raise InputError('the soles are behind the camera')
        distance = seen + config.surface_depth
        errors = config.feet_error * view.body.height, config.depth_error * distance
        return view.place(away, distance, errors, DEPTH)

    def _on_ground(self, view: _View) -> _Place:
        if not view.pose.grounded:
            raise InputError('neither a depth image nor the ground says where')
        height, level = view.pose.position[2], math.hypot(*view.soles[:2])
        if view.soles[2] >= 0:
            raise InputError('the soles are at or above the horizon')
        if level == 0:
            raise InputError('the soles are straight below the camera')
        distance = -height / view.soles[2] * level
        if distance > self.config.max_distance:
            raise InputError(
                f'{distance:.1f} m away on the ground, above localization.max_distance'
            )
        pixels = self.config.feet_error * view.body.height
        along = pixels / view.camera.fy * (distance**2 + height**2) / height
        return view.place(view.soles[:2] / level, distance, (pixels, along), GROUND)

    def _predicted(self, walk: _Track, time_s: float) -> _Place | None:
        """Return the predicted place of a person who was just located by depth."""
        motion = self._motion(walk, DEPTH)
        if motion is None or motion.last.time_s - walk[0].time_s < _WATCHED_S:
            return None
        since = time_s - motion.last.time_s
        at, covariance = motion.last.at.copy(), motion.last.covariance.copy()
        at[:2] += since * motion.velocity
        covariance[:2, :2] += since**2 * motion.covariance
        return _Place(time_s, at, covariance, PREDICTED)

    def _motion(self, walk: _Track, source: str) -> _Motion | None:
        """Return the motion by the places from a source, None of fewer than three."""
        samples = [each for each in walk if each.source == source]
        if len(samples) < 3:
            return None
        since = np.array([each.time_s for each in samples]) - samples[-1].time_s
        places = np.array([each.at[:2] for each in samples])
        weights = np.linalg.inv(np.array([each.covariance[:2, :2] for each in samples]))
        velocity, covariance = _fitted(since, places, weights, self.config.acceleration)
        # A straight line says best how fast, and nothing of turns.
        centred = since - since.mean()
        straight = centred @ places / (centred @ centred)
        return _Motion(samples[-1], velocity, covariance, math.hypot(*straight))

    def _location(
        self, match: MatchResult, view: _View, place: _Place, motion: _Motion | None
    ) -> Location:
        pose, walk = view.pose, self._tracks[match.track_id]
        turn = pose.rotation.T
        yaw, error = self._heading(view.away, match.azimuth, motion)
        distance = math.hypot(*(place.at - pose.position)[:2])
        stature = view.body.height / view.camera.fy * distance / math.hypot(*view.middle[:2])
        speed = step = None
        if motion is not None and walk[-1].time_s - walk[0].time_s >= _WATCHED_S:
            speed, step = _of_walker(motion.speed, match.phase_rate, stature)
        position = turn @ (place.at - pose.position)
        numbers = (*position, *place.covariance.ravel(), yaw, error, stature, speed or 0.0)
        # Written so that what is no number is refused.
        if not (np.linalg.norm(position) <= _FARTHEST_M and all(map(math.isfinite, numbers))):
            raise InputError('the numbers that come are those of no place')
        # Whether it is known how high the camera is, or how it is tilted.
        levelled = pose.grounded or bool(pose.rotation[2, 2])
        return Location(
            track_id=match.track_id,
            position=position,
            covariance=turn @ place.covariance @ turn.T,
            heading=turn @ (math.cos(yaw), math.sin(yaw), 0.0),
            up=turn @ (0.0, 0.0, 1.0),
            yaw=yaw,
            heading_error=error,
            speed=speed,
            step_length=step,
            stature=stature,
            distance=distance if levelled else float(position[2]),
            source=place.source,
        )

    def _heading(
        self, away: DoubleArray, azimuth: float, motion: _Motion | None
    ) -> tuple[float, float]:
        """Return yaw and its error: gait and motion, each weighed by how sure it is."""
        right = np.array([away[1], -away[0]])
        across, along = math.cos(azimuth) * right, math.sin(azimuth) * away
        headings = [across + along, across - along]
        weight = 1 / math.radians(self.config.gait_error) ** 2
        speed = 0.0 if motion is None else math.hypot(*motion.velocity)
        if motion is None or speed == 0:
            return math.atan2(headings[0][1], headings[0][0]), 1 / math.sqrt(weight)
        ahead = motion.velocity / speed
        sideways = np.array([-ahead[1], ahead[0]])
        by_motion = speed**2 / (sideways @ motion.covariance @ sideways)
        # From the front and from behind silhouettes are alike: which it is the motion says.
        heading = headings[0]
        if by_motion > weight:
            heading = max(headings, key=lambda each: float(each @ ahead))
        joint = weight * heading + by_motion * ahead
        return math.atan2(joint[1], joint[0]), 1 / math.sqrt(weight + by_motion)


def _of_walker(
    speed: float, stride_rate: float, stature: float
) -> tuple[float | None, float | None]:
    """Return speed and step length, None where they are not those of a walker."""
    # Written so that what is no number is left out.
    if not speed <= _FASTEST_M_S:
        return None, None
    if not _STRIDES_HZ[0] <= stride_rate <= _STRIDES_HZ[1]:
        return speed, None
    step = speed / (2 * stride_rate)
    return speed, step if _STEPS[0] * stature <= step <= _STEPS[1] * stature else None


def _fitted(
    since: DoubleArray, places: DoubleArray, weights: DoubleArray, acceleration: float
) -> tuple[DoubleArray, DoubleArray]:
    """Return the velocity (2,) at time 0, fitted with an acceleration, and its covariance."""
    powers = np.column_stack([np.ones_like(since), since, since**2 / 2])
    normal = np.einsum('ni,nj,nkl->ikjl', powers, powers, weights).reshape(6, 6)
    normal[4:, 4:] += np.eye(2) / acceleration**2
    right = np.einsum('ni,nkl,nl->ik', powers, weights, places).reshape(6)
    covariance = np.linalg.inv(normal)
    return (covariance @ right)[2:4], covariance[2:4, 2:4]
