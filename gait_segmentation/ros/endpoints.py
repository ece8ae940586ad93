# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The QoS of publishers and subscriptions, and what rclpy refuses."""

from __future__ import annotations

from rclpy.qos import DurabilityPolicy, QoSPolicyKind, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions

from gait_segmentation.streams.fields import QUEUE_DEPTH

BETWEEN_NODES = QoSProfile(depth=QUEUE_DEPTH)
"""Reliable: of all that the nodes publish, and of what they receive from each other."""

BEST_EFFORT = QoSProfile(depth=QUEUE_DEPTH, reliability=ReliabilityPolicy.BEST_EFFORT)
"""Of subscriptions that take what others publish, however they do it."""

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""Of what is published once and must reach those who come later."""

OVERRIDABLE = QoSOverridingOptions(
    (QoSPolicyKind.HISTORY, QoSPolicyKind.DEPTH, QoSPolicyKind.RELIABILITY)
)
"""What parameters of the kind ``qos_overrides`` may change."""


def said_by(error: Exception) -> str:
    """Return what an error of rclpy says, without the name it points to a place in."""
    return str(error).partition('\n')[0].rstrip(':')
