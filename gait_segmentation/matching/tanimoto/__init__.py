# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tanimoto similarity of all templates with all windows of likelihood images, on integers."""

from gait_segmentation.matching.tanimoto.events import EventKernel, pitch_of, polyphase
from gait_segmentation.matching.tanimoto.windows import WindowGrid

__all__ = [
    'EventKernel',
    'WindowGrid',
    'pitch_of',
    'polyphase',
]
