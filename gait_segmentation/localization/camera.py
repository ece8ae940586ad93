# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A pinhole camera, by camera_info, where it stands, and what its depth images say."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import InputError
from gait_segmentation.geometry import Box

DoubleArray = NDArray[np.float64]
DepthImage = NDArray[np.uint16] | NDArray[np.float32]

_DISTORTIONS = ('', 'plumb_bob', 'rational_polynomial')
_FOCAL = (0.01, 1000.0)  # focal lengths of any lens, in sizes of the image
# How far the principal point of a cropped image may lie beside it, in sizes of the image.
_ASIDE = 10.0
_SAMPLES = 500  # pixels of a body that are used
# How far inside the outline depth is trusted, in heights of the mask: at the edge it mixes.
_INSIDE = 0.01
_LEAST_VALID = 0.2  # share of the body's pixels that must have a depth
# How far limbs reach from the body's axis: what is farther from the median is not the body.
_REACH_M = 0.5
_MOST_HEIGHT_M, _MOST_AWAY_M = 1e4, 1e9


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
        for size, focal, middle in (
            (self.width, self.fx, self.cx),
            (self.height, self.fy, self.cy),
        ):
            # Written so that what is no number is refused.
            fits = _FOCAL[0] * size <= focal <= _FOCAL[1] * size
            if not (fits and abs(middle - size / 2) <= _ASIDE * size):
                raise InputError(
                    f'camera_info must have focal lengths of {_FOCAL[0]:g} to {_FOCAL[1]:g} and '
                    f'a principal point within {_ASIDE:g} sizes of the image, got fx {self.fx:g}, '
                    f'fy {self.fy:g}, cx {self.cx:g}, cy {self.cy:g} for '
                    f'{self.width} x {self.height}'
                )
        if not all(map(math.isfinite, self.distortion)):
            raise InputError(f'camera_info must have a finite distortion, got {self.distortion}')
        if len(self.distortion) not in (0, 4, 5, 8, 12, 14):
            raise InputError(
                'camera_info must have 0, 4, 5, 8, 12 or 14 distortion coefficients, got '
                f'{len(self.distortion)}'
            )

    def check_size(self, shape: tuple[int, ...]) -> None:
        """Raise InputError if (height, width) of an image is not the camera's."""
        if tuple(shape) != (self.height, self.width):
            raise InputError(
                f'camera_info is of images of {self.width} x {self.height}, but the image has '
                f'{shape[1]} x {shape[0]}'
            )

    def rays(self, points: DoubleArray) -> DoubleArray:
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

    rotation: DoubleArray
    position: DoubleArray
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
            1e-3 <= length <= 1e3
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


def read_camera(
    message: Any, rectified: bool = False, shape: tuple[int, ...] | None = None
) -> PinholeCamera:
    """
    Return the camera of a camera_info message, as its binning and region of interest leave it.

    :param rectified: whether the images are: then P is read, else K and D.
    :param shape: (height, width) of the images: where it is that of the whole sensor, the
        calibration is of these images, whatever binning and region the driver names.
    :raises InputError: if it is no camera, or its distortion is of another kind than OpenCV's.
    """
    matrix, columns, distortion = (message.p, 4, ()) if rectified else (message.k, 3, message.d)
    if not rectified and message.distortion_model not in _DISTORTIONS and any(message.d):
        raise InputError(
            'the distortion_model of camera_info must be plumb_bob or rational_polynomial, got '
            f'{message.distortion_model[:40]!r}: rectify the images, and set rectified'
        )
    if not any(matrix):
        raise InputError(
            f'the camera is not calibrated (camera_info has {"P" if rectified else "K"} of '
            'zeros): calibrate it, such as with camera_calibration, and have its driver load that'
        )
    size = message.width, message.height
    across = float(matrix[0]), float(matrix[2])
    down = float(matrix[columns + 1]), float(matrix[columns + 2])
    if shape is None or tuple(shape) != size[::-1]:
        roi = message.roi
        # All zero stands for all of it, and for one pixel of each.
        part = (roi.width, roi.height) if roi.width or roi.height else size
        n_x, n_y = max(message.binning_x, 1), max(message.binning_y, 1)
        small = part[0] // n_x, part[1] // n_y
        if roi.x_offset + part[0] > size[0] or roi.y_offset + part[1] > size[1] or 0 in small:
            raise InputError(
                f'roi and binning of camera_info must leave a part of {size[0]} x {size[1]}, got '
                f'{part[0]} x {part[1]} at {roi.x_offset}, {roi.y_offset} and {n_x} x {n_y}'
            )
        size, across, down = (
            small,
            _cropped(*across, roi.x_offset, n_x),
            _cropped(*down, roi.y_offset, n_y),
        )
    (fx, cx), (fy, cy) = across, down
    return PinholeCamera(*size, fx, fy, cx, cy, tuple(map(float, distortion)))


def _cropped(focal: float, middle: float, first: int, binning: int) -> tuple[float, float]:
    """Return focal length and principal point, pixel centres at whole numbers, of a part."""
    return focal / binning, (middle - first + 0.5) / binning - 0.5


def distance_by_depth(
    depth: DepthImage,
    mask: NDArray[np.uint8],
    camera: PinholeCamera,
    pose: CameraPose,
    towards: DoubleArray,
    most: float,
) -> float:
    """
    Return the distance over the ground of the surface that is seen of a body, in metres.

    The median over the pixels of the mask, then that of those within reach of it: holes and what
    shows through them count nothing.

    :param depth: (H, W) along the camera's z, uint16 in millimetres or float32 in metres; zero,
        negative, not finite or beyond ``most`` is invalid.
    :param mask: (H, W) uint8, not zero = body.
    :param towards: (2,) the horizontal direction from the camera to the body, of length 1.
    :param most: largest distance in metres.
    :raises InputError: if too little of the body has a valid depth.
    """
    box = Box.around(mask)
    if box is None:
        raise InputError('the mask is empty')
    rows, columns = box.slices(mask.shape[1], mask.shape[0])
    body = mask[rows, columns]
    size = 1 + 2 * math.ceil(_INSIDE * box.height)
    inside = cv2.erode(body, np.ones((size, size), np.uint8), borderValue=0)
    seen = np.flatnonzero(inside)
    if not seen.size:  # A body so thin has no inside.
        seen = np.flatnonzero(body)
    # Not every so many rows and columns, which holes may be as well.
    y, x = np.divmod(seen[:: math.ceil(len(seen) / _SAMPLES)], inside.shape[1])
    at = depth[rows, columns][y, x]
    metres = at * np.float64(1e-3) if depth.dtype == np.uint16 else at.astype(np.float64)
    valid = (metres > 0) & (metres <= most)  # What is no number is not valid.
    if not valid.any():
        raise InputError('no depth on the body')
    if valid.sum() < _LEAST_VALID * len(valid):
        raise InputError(
            f'depth on {valid.mean():.0%} of the body only ({_LEAST_VALID:.0%} are needed)'
        )
    points = np.column_stack([x, y])[valid] + (columns.start + 0.5, rows.start + 0.5)
    along = camera.rays(points) @ (pose.rotation[:2].T @ towards) * metres[valid]
    distance = float(np.median(along[np.abs(along - np.median(along)) <= _REACH_M]))
    if not distance > 0:
        raise InputError('its depth does not lie where the body is seen')
    return distance
