# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The background pixel by pixel; see :mod:`gait_segmentation.tracking.background.model`."""

from __future__ import annotations

from gait_segmentation.tracking.features.base import DirectFeature

__all__ = ['FEATURE']

FEATURE = DirectFeature('background', lambda view: view.evidence.get('background'))
