# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Starting: the first mask of a track from a box alone."""

from gait_segmentation.starting.config import StartingConfig
from gait_segmentation.starting.first_mask import FirstMask, estimate_first_mask

__all__ = ['FirstMask', 'StartingConfig', 'estimate_first_mask']
