# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The calibration that a message (sensor_msgs/CameraInfo) tells."""

from __future__ import annotations

from typing import Any

from gait_segmentation.errors import InputError
from gait_segmentation.localization.camera import PinholeCamera

__all__ = ['read_camera']

_DISTORTIONS = ('', 'plumb_bob', 'rational_polynomial')


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
    fx, cx, fy, cy = (float(matrix[k]) for k in (0, 2, columns + 1, columns + 2))
    size = message.width, message.height
    if shape is None or tuple(shape) != size[::-1]:
        size, (fx, cx), (fy, cy) = _cropped(message, (fx, cx), (fy, cy))
    return PinholeCamera(*size, fx, fy, cx, cy, tuple(map(float, distortion)))


def _cropped(
    message: Any, across: tuple[float, float], down: tuple[float, float]
) -> tuple[tuple[int, int], tuple[float, float], tuple[float, float]]:
    """
    Return the size of the images of a part of a sensor, some pixels of which are made one.

    :param across: focal length and principal point of the whole sensor; ``down`` likewise.
    :returns: width and height of the images, and the same two for them.
    :raises InputError: if nothing is left.
    """
    roi, whole = message.roi, (message.width, message.height)
    binning = max(message.binning_x, 1), max(message.binning_y, 1)
    # All zero stands for all of it.
    part = (roi.width, roi.height) if roi.width or roi.height else whole
    corner = roi.x_offset, roi.y_offset
    size = part[0] // binning[0], part[1] // binning[1]
    fits = all(at + length <= most for at, length, most in zip(corner, part, whole, strict=True))
    if not fits or 0 in size:
        raise InputError(
            f'roi and binning of camera_info must leave a part of {whole[0]} x {whole[1]}, got '
            f'{part[0]} x {part[1]} at {corner[0]}, {corner[1]} and {binning[0]} x {binning[1]}'
        )
    (fx, cx), (fy, cy) = (
        # Pixel centres are at whole numbers.
        (focal / n, (middle - at + 0.5) / n - 0.5)
        for (focal, middle), at, n in zip((across, down), corner, binning, strict=True)
    )
    return size, (fx, cx), (fy, cy)
