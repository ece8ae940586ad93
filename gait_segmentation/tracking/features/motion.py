# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What moves with the body; see :mod:`gait_segmentation.tracking.likelihood.cues`."""

from __future__ import annotations

from gait_segmentation.tracking.features.base import DirectFeature

__all__ = ['FEATURE']

FEATURE = DirectFeature('motion', lambda view: view.evidence.get('motion'))
