# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The joint Lab histogram in bands of the body; see :mod:`gait_segmentation.colour`."""

from __future__ import annotations

from gait_segmentation.tracking.features.base import DirectFeature

__all__ = ['FEATURE']

FEATURE = DirectFeature('colour', lambda view: view.evidence.get('colour'))
