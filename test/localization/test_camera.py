# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import math
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from gait_segmentation.errors import InputError
from gait_segmentation.localization import CameraPose, PinholeCamera, read_camera
from gait_segmentation.localization.camera import distance_by_depth

CAMERA = PinholeCamera(640, 480, 500.0, 510.0, 320.0, 240.0)


def test_rays_are_the_inverse_of_the_projection() -> None:
    points = np.array([[0.3, -0.2, 2.0], [-1.0, 0.5, 4.0]])
    for distortion in ((), (0.1, -0.05, 0.001, 0.002, 0.01)):
        camera = PinholeCamera(640, 480, 500.0, 510.0, 320.0, 240.0, distortion)
        matrix = np.array([[500.0, 0, 320], [0, 510, 240], [0, 0, 1]])
        none = np.zeros(3)
        given = np.array(distortion or (0.0,) * 4)
        at, _ = cv2.projectPoints(points, none, none, matrix, given)
        rays = camera.rays(at[:, 0] + 0.5)
        np.testing.assert_allclose(rays, points / points[:, 2:], atol=1e-5)


@pytest.mark.parametrize(
    'change',
    [
        {'fx': 0.0},
        {'fy': math.nan},
        {'fy': 1e-3},
        {'cx': math.nan},
        {'cx': 320.0 + 6401.0},
        {'distortion': (0.1, 0.2)},
    ],
)
def test_what_is_no_camera_is_refused(change: dict) -> None:
    given = {'width': 640, 'height': 480, 'fx': 500.0, 'fy': 500.0, 'cx': 320.0, 'cy': 240.0}
    with pytest.raises(InputError, match='camera_info must have'):
        PinholeCamera(**{**given, **change})


def test_a_distortion_that_leads_nowhere_is_refused() -> None:
    camera = PinholeCamera(640, 480, 500.0, 510.0, 320.0, 240.0, (-1.0, 0.0, 0.0, 0.0))
    with pytest.raises(InputError):
        camera.rays(np.array([(820.5, 240.5)]))


def test_a_camera_that_looks_down_sees_the_ground_ahead() -> None:
    pose = CameraPose.above_ground(2.0, math.radians(45))
    np.testing.assert_allclose(pose.rotation @ (0, 0, 1), [math.sqrt(0.5), 0, -math.sqrt(0.5)])
    np.testing.assert_allclose(pose.rotation @ (1, 0, 0), [0, -1, 0])
    np.testing.assert_allclose(pose.rotation @ pose.rotation.T, np.eye(3), atol=1e-12)
    assert pose.grounded
    assert not CameraPose.above_ground(0.0).grounded


@pytest.mark.parametrize(
    ('position', 'turn'),
    [
        ((0, 0, -1.0), (0, 0, 0, 1)),
        ((0, 0, 1.0), (0, 0, 0, 0)),
        ((0, math.nan, 1.0), (0, 0, 0, 1)),
        ((0, 0, 1.0), (0, math.inf, 0, 1)),
    ],
)
def test_a_transform_that_makes_no_sense_is_refused(position: tuple, turn: tuple) -> None:
    with pytest.raises(InputError, match='the camera must be above the ground_frame'):
        CameraPose.from_quaternion(position, turn)


def test_a_binned_part_of_a_sensor_has_its_pixel_centres_where_they_are() -> None:
    roi = SimpleNamespace(x_offset=100, y_offset=40, width=400, height=300)
    matrix = [500.0, 0, 319.5, 0, 510.0, 239.5, 0, 0, 1]
    message = SimpleNamespace(
        width=640,
        height=480,
        k=matrix,
        d=[],
        distortion_model='',
        roi=roi,
        binning_x=2,
        binning_y=1,
    )
    camera = read_camera(message)
    assert (camera.width, camera.height) == (200, 300)
    # The centre of the sensor is between two pixels, and so 110 pixels of two to the right.
    assert (camera.fx, camera.cx) == (250.0, 109.5)
    assert (camera.fy, camera.cy) == (510.0, 199.5)
    whole = read_camera(message, shape=(480, 640))
    assert (whole.width, whole.cx) == (640, 319.5)
    for part in ((600, 0, 160, 120), (0, 0, 2**32 - 1, 2**32 - 1), (0, 0, 160, 0)):
        values = dict(zip(('x_offset', 'y_offset', 'width', 'height'), part, strict=True))
        message.roi = SimpleNamespace(**values)
        with pytest.raises(InputError, match='must leave a part of 640 x 480, got'):
            read_camera(message)
    message.roi, message.k = roi, [0.0] * 9
    with pytest.raises(InputError, match='the camera is not calibrated'):
        read_camera(message)


def test_what_shows_through_holes_of_a_mask_does_not_count_as_body() -> None:
    depth = np.repeat(np.linspace(2.0, 2.4, 120, dtype=np.float32)[:, None], 160, axis=1)
    depth[np.random.default_rng(0).random(depth.shape) < 0.4] = 6.0
    mask = np.zeros(depth.shape, np.uint8)
    mask[20:100, 60:100] = 255
    camera = PinholeCamera(160, 120, 150.0, 150.0, 79.5, 59.5)
    pose, ahead = CameraPose.above_ground(1.0), np.array([1.0, 0.0])
    found = distance_by_depth(depth, mask, camera, pose, ahead, 20.0)
    assert found == pytest.approx(2.2, abs=0.03)
