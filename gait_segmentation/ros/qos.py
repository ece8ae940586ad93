# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The QoS profiles of all endpoints."""

from __future__ import annotations

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

__all__ = ['BETWEEN_NODES', 'LATCHED', 'RELIABLE_DEPTH', 'image_profile']

RELIABLE_DEPTH = 30
"""Frames that a publisher keeps for a reader that is slow to acknowledge."""

BETWEEN_NODES = QoSProfile(
    history=HistoryPolicy.KEEP_LAST,
    depth=RELIABLE_DEPTH,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.VOLATILE,
)
"""Of everything that the nodes publish, and of what they receive from each other."""

LATCHED = QoSProfile(
    history=HistoryPolicy.KEEP_LAST,
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
"""Of what is told once and must reach those who come later."""


def image_profile(best_effort: bool) -> QoSProfile:
    """Return the profile of a subscription to a camera."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=RELIABLE_DEPTH,
        reliability=(ReliabilityPolicy.BEST_EFFORT if best_effort else ReliabilityPolicy.RELIABLE),
        durability=DurabilityPolicy.VOLATILE,
    )
