# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Clips made of sequences with truth, harder than they are: for measuring what holds."""

from benchmarks.variants.kinds import KINDS, PAIRED, moved_boxes, variants_of
from benchmarks.variants.made_clip import MadeClip

__all__ = ['KINDS', 'PAIRED', 'MadeClip', 'moved_boxes', 'variants_of']
