# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the nodes publish and subscribe with, and how they tell what cannot come."""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from typing import Any

from rclpy.event_handler import (
    PublisherEventCallbacks,
    QoSMessageLostInfo,
    QoSRequestedIncompatibleQoSInfo,
    SubscriptionEventCallbacks,
)
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import (
    DurabilityPolicy,
    QoSPolicyKind,
    QoSProfile,
    ReliabilityPolicy,
    qos_policy_name_from_kind,
)
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.subscription import Subscription

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


def publisher(node: Node, kind: Any, topic: str, profile: QoSProfile) -> Publisher:
    """Make a publisher whose quality of service may be overridden."""
    # Every event that could be reported costs the executor time in every round.
    events = PublisherEventCallbacks(use_default_callbacks=False)
    # Overrides are written into the profile.
    return node.create_publisher(
        kind,
        topic,
        copy(profile),
        event_callbacks=events,
        qos_overriding_options=OVERRIDABLE,
    )


def subscription(
    node: Node,
    kind: Any,
    topic: str,
    received: Callable[[Any], None],
    profile: QoSProfile,
    warn: Callable[[str, str], None],
    lost: Callable[[QoSMessageLostInfo], None] | None,
) -> Subscription:
    """
    Make a subscription whose quality of service may be overridden.

    :param warn: takes the topic, and why nothing comes from it.
    :param lost: takes how many messages were lost on the way, None if that is of no interest.
    """

    def incompatible(event: QoSRequestedIncompatibleQoSInfo) -> None:
        policy = qos_policy_name_from_kind(event.last_policy_kind)
        latched = profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
        warn(
            topic,
            f'a publisher on {topic} offers an incompatible QoS ({policy}); no messages come '
            'from it: it must be reliable' + ' and transient local' * latched,
        )

    events = SubscriptionEventCallbacks(
        incompatible_qos=incompatible, message_lost=lost, use_default_callbacks=False
    )
    return node.create_subscription(
        kind,
        topic,
        received,
        copy(profile),
        event_callbacks=events,
        qos_overriding_options=OVERRIDABLE,
    )
