# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Saturation: colourful against grey."""

from __future__ import annotations

import cv2
import numpy as np

from gait_segmentation.tracking.features.base import ChannelFeature

__all__ = ['FEATURE']

FEATURE = ChannelFeature('S', lambda view: np.asarray(cv2.extractChannel(view.thin_hsv, 1)))
