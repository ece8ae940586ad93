# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tracking: where people are, and how likely each pixel belongs to each of them."""

from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.tracker import PeopleTracker

__all__ = ['PeopleTracker', 'TrackingConfig']
