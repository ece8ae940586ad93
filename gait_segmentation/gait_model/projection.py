# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Weak perspective views of a body."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.solid import Body

__all__ = ['extent', 'project', 'view_matrix']


def view_matrix(azimuth: float, elevation: float = 0.0) -> NDArray[np.float64]:
    """
    Return the (3, 3) matrix from the body's axes to (right, down, away) of the camera.

    :param azimuth: walking direction in radians: 0 to the right in the image, pi/2 away from the
        camera, pi to the left, -pi/2 towards the camera.
    :param elevation: how far the camera looks down, radians.
    """
    cos_a, sin_a = math.cos(azimuth), math.sin(azimuth)
    cos_e, sin_e = math.cos(elevation), math.sin(elevation)
    level = np.array([[cos_a, -sin_a, 0.0], [sin_a, cos_a, 0.0], [0.0, 0.0, 1.0]])
    tilt = np.array([[1.0, 0.0, 0.0], [0.0, -sin_e, -cos_e], [0.0, cos_e, -sin_e]])
    return tilt @ level


def project(
    body: Body, azimuth: float, elevation: float = 0.0
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """
    Project all ellipsoids of a body.

    :returns: centres (P, E, 2) and semi-axes (P, E, 2, 3) with x to the right and y down, and
        the distances from the camera (P, E) up to a constant, all in statures.
    """
    view = view_matrix(azimuth, elevation)
    centers = body.centers @ view.T
    axes = view[:2] @ body.axes
    return centers[..., :2], axes, centers[..., 2]


def extent(
    centers: NDArray[np.float64], axes: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return left, top, right and bottom of projected ellipsoids at every phase, each (P,)."""
    half = np.sqrt((axes**2).sum(axis=-1))
    low, high = (centers - half).min(axis=1), (centers + half).max(axis=1)
    return low[:, 0], low[:, 1], high[:, 0], high[:, 1]
