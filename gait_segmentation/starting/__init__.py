# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Starting: people found by their walk, and the first mask of a track from a box alone."""

from gait_segmentation.starting.config import StartingConfig
from gait_segmentation.starting.estimate import Start, estimate_start
from gait_segmentation.starting.finder import WalkerFinder

__all__ = ['Start', 'StartingConfig', 'WalkerFinder', 'estimate_start']
