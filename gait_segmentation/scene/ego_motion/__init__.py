# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Motion of the camera, and of bodies against it, from sparse optical flow."""

from gait_segmentation.scene.ego_motion.estimator import MotionEstimator
from gait_segmentation.scene.ego_motion.world_motion import WorldMotion

__all__ = ['MotionEstimator', 'WorldMotion']
