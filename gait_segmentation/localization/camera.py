# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A pinhole camera and where it stands."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import InputError

__all__ = ['CameraPose', 'PinholeCamera']

Floats = NDArray[np.float64]

_FOCAL = (0.01, 1000.0)
"""Focal lengths of any lens, in sizes of the image."""

_ASIDE = 10.0
"""How far the principal point of a cropped image may lie beside it, in sizes of the image."""

_MOST_HEIGHT_M, _MOST_AWAY_M = 1e4, 1e9
_TURN = (1e-3, 1e3)
"""How long a quaternion may be that means a rotation."""


@dataclass(frozen=True)
class PinholeCamera:
    """
    The calibration of a camera, as OpenCV and camera_info have it.

    ``fx, fy`` are the focal lengths and ``cx, cy`` the principal point in pixels, pixel centres
    at whole numbers; ``distortion`` holds the coefficients of OpenCV's model, none or 4 to 14.

    :raises InputError: if the numbers are those of no camera.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Refuse what is no camera."""
        numbers = (self.fx, self.fy, self.cx, self.cy, *self.distortion)
        given = f'got fx {self.fx:g}, fy {self.fy:g}, cx {self.cx:g}, cy {self.cy:g}'
        if not all(map(math.isfinite, numbers)) or min(self.fx, self.fy) <= 0:
            raise InputError(
                f'camera_info must have finite numbers and focal lengths above zero, {given}'
            )
        for size, focal, middle in (
            (self.width, self.fx, self.cx),
            (self.height, self.fy, self.cy),
        ):
            low, high = _FOCAL[0] * size, _FOCAL[1] * size
            if not (low <= focal <= high and abs(middle - size / 2) <= _ASIDE * size):
                raise InputError(
                    f'camera_info must have focal lengths of {_FOCAL[0]:g} to {_FOCAL[1]:g} and '
                    f'a principal point within {_ASIDE:g} sizes of the image, {given} for '
                    f'{self.width} x {self.height}'
                )
        if len(self.distortion) not in (0, 4, 5, 8, 12, 14):
            raise InputError(
                'camera_info must have 0, 4, 5, 8, 12 or 14 distortion coefficients, got '
                f'{len(self.distortion)}'
            )

    def check_size(self, shape: tuple[int, ...]) -> None:
        """
        Refuse images of another size.

        :param shape: (height, width) of the image.
        :raises InputError: if it is not the camera's.
        """
        if tuple(shape) != (self.height, self.width):
            raise InputError(
                f'camera_info is of images of {self.width} x {self.height}, but the image has '
                f'{shape[1]} x {shape[0]}'
            )

    def rays(self, points: Floats) -> Floats:
        """
        Return the rays through points of the image, in the camera's frame.

        :param points: (N, 2) x and y in pixels, pixel centres at whole numbers and a half.
        :returns: (N, 3) with z = 1.
        :raises InputError: if the distortion leads nowhere there.
        """
        at = np.asarray(points, np.float64).reshape(-1, 2) - 0.5
        if any(self.distortion) and len(at):
            matrix = np.array([[self.fx, 0, self.cx], [0, self.fy, self.cy], [0, 0, 1]])
            flat = cv2.undistortPoints(at[:, None], matrix, np.array(self.distortion))[:, 0]
        else:
            flat = (at - (self.cx, self.cy)) / (self.fx, self.fy)
        if not np.isfinite(flat).all():
            raise InputError(
                'the distortion of camera_info must give each pixel a ray, got '
                f'{", ".join(format(each, "g") for each in self.distortion)}'
            )
        return np.column_stack([flat, np.ones(len(flat))])


@dataclass(frozen=True)
class CameraPose:
    """
    Where a camera is over the ground.

    ``rotation`` (3, 3) turns vectors of the camera's frame into the ground's, ``position`` (3,)
    is the camera there.  ``grounded`` says whether z = 0 is the ground; else it is level with the
    camera.
    """

    rotation: Floats
    position: Floats
    grounded: bool

    @classmethod
    def above_ground(cls, height: float, pitch: float = 0.0) -> CameraPose:
        """
        Return the pose over the point below the camera, x to the front and y to the left.

        :param height: height of the camera in metres; 0 = unknown.
        :param pitch: how far it looks down, in radians.
        """
        cos, sin = math.cos(pitch), math.sin(pitch)
        right, down, ahead = (0.0, -1.0, 0.0), (-sin, 0.0, -cos), (cos, 0.0, -sin)
        return cls(np.column_stack([right, down, ahead]), np.array([0.0, 0.0, height]), height > 0)

    @classmethod
    def from_quaternion(
        cls, position: tuple[float, float, float], turn: tuple[float, float, float, float]
    ) -> CameraPose:
        """
        Return the pose that a transform from the camera's frame to the ground's means.

        :param position: its translation in metres.
        :param turn: its rotation as a quaternion x, y, z, w.
        :raises InputError: if the camera is not above the ground or a number is not finite.
        """
        length = math.hypot(*turn)
        # Written so that what is no number is refused.
        if not (
            _TURN[0] <= length <= _TURN[1]
            and 0 < position[2] <= _MOST_HEIGHT_M
            and math.hypot(*position) <= _MOST_AWAY_M
        ):
            raise InputError(
                f'the camera must be above the ground_frame, by {_MOST_HEIGHT_M:g} m at most, '
                f'with a finite transform, got the position {position} and the rotation {turn}'
            )
        *axis, w = np.array(turn) / length
        across = np.cross(np.eye(3), axis)
        rotation = np.eye(3) + 2 * (w * across + across @ across)
        return cls(rotation, np.array(position, np.float64), True)
