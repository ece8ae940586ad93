# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The pool of features and the choice among them.

Every module of this package with a constant ``FEATURE`` is in the pool.
"""

from gait_segmentation.tracking.features.base import ChannelFeature, DirectFeature, Feature, View
from gait_segmentation.tracking.features.pool import pool
from gait_segmentation.tracking.features.selection import STEP, FeatureSelector

__all__ = ['STEP', 'ChannelFeature', 'DirectFeature', 'Feature', 'FeatureSelector', 'View', 'pool']

# Now, and not when the first frame comes: some have kernels.
pool()
