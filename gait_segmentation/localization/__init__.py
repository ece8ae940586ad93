# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Where people are in metres, in which direction they walk and how fast.

Frames
    The *camera's* is the optical one: x right, y down, z into the scene.  The *ground's* has z up,
    and z = 0 on the ground where that is known; lengths are in metres.
"""

from __future__ import annotations

from gait_segmentation.localization.camera import CameraPose, PinholeCamera, read_camera
from gait_segmentation.localization.config import LocalizationConfig
from gait_segmentation.localization.localizer import Localizer, Location

__all__ = [
    'CameraPose',
    'LocalizationConfig',
    'Localizer',
    'Location',
    'PinholeCamera',
    'read_camera',
]
