# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The pool of features and the choice among them, for adaptive mean shift."""

from gait_segmentation.tracking.features.pool import View
from gait_segmentation.tracking.features.selection import FeatureSelector

__all__ = ['FeatureSelector', 'View']
