# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Tracking: where people are, and how likely each pixel belongs to each of them.

``tracker`` has the slots, ``group`` the people who may overlap, ``target`` one of them; ``world``
is what all of about one size share.  The packages hold what these are made of.
"""

from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.tracker import PeopleTracker

__all__ = ['PeopleTracker', 'TrackingConfig']
