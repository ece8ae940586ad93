# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Starting: the first mask of a track, from a box alone."""

from gait_segmentation.starting.estimate import Start, estimate_start

__all__ = ['Start', 'estimate_start']
