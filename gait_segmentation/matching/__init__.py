# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Sequence matching: Tanimoto kernels, placements and the path search."""

from gait_segmentation.matching.config import MatchingConfig
from gait_segmentation.matching.matcher import PeopleMatcher, SequenceMatcher

__all__ = ['MatchingConfig', 'PeopleMatcher', 'SequenceMatcher']
