# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tracking: where the person is, and how likely each pixel belongs to the person."""

from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.tracker import PersonTracker

__all__ = ['PersonTracker', 'TrackingConfig']
