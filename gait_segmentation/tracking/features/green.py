# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Green of the camera."""

from __future__ import annotations

from gait_segmentation.tracking.features.base import ChannelFeature

__all__ = ['FEATURE']

FEATURE = ChannelFeature('G', lambda view: view.plane(1))
