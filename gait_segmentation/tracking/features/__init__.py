# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The pool of features and the choice among them."""

from gait_segmentation.tracking.features.pool import POOL, View
from gait_segmentation.tracking.features.selection import STEP, FeatureSelector

__all__ = ['POOL', 'STEP', 'FeatureSelector', 'View']
