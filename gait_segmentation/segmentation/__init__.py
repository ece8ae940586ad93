# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Segmentation: the graph cut that turns likelihood and shape prior into a silhouette."""

from gait_segmentation.segmentation.config import SegmentationConfig
from gait_segmentation.segmentation.segmenter import PeopleMasks, PeopleSegmenter

__all__ = ['PeopleMasks', 'PeopleSegmenter', 'SegmentationConfig']
