# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Share of green, g = G / (R + G + B), which the brightness of the light does not change."""

from __future__ import annotations

from gait_segmentation.tracking.features.base import ChannelFeature

__all__ = ['FEATURE']

FEATURE = ChannelFeature('g', lambda view: view.share(1))
