# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Publishers and subscriptions whose QoS can be overridden, and that cost the executor little."""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from typing import TYPE_CHECKING, Any

from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.impl.implementation_singleton import rclpy_implementation
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
from rclpy.serialization import deserialize_message
from rclpy.subscription import Subscription

from gait_segmentation.streams.fields import DEPTH

if TYPE_CHECKING:
    from rclpy.event_handler import QoSRequestedIncompatibleQoSInfo


BETWEEN_NODES = QoSProfile(depth=DEPTH)
"""Reliable: of all that the nodes publish, and of what they receive from each other."""

BEST_EFFORT = QoSProfile(depth=DEPTH, reliability=ReliabilityPolicy.BEST_EFFORT)
"""Of subscriptions that take what others publish, however they do it."""

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""Of what is told once and must reach those who come later."""

_OVERRIDABLE = (QoSPolicyKind.HISTORY, QoSPolicyKind.DEPTH, QoSPolicyKind.RELIABILITY)
"""What parameters of the kind ``qos_overrides`` may change."""


def publisher(node: Node, kind: Any, topic: str, profile: QoSProfile) -> Publisher:
    """Make a publisher of messages of a kind."""
    return node.create_publisher(
        kind,
        topic,
        # A copy, because overrides are written into it.
        copy(profile),
        # Every event that could be reported costs the executor time in every round.
        event_callbacks=PublisherEventCallbacks(use_default_callbacks=False),
        qos_overriding_options=QoSOverridingOptions(_OVERRIDABLE),
    )


def subscription(
    node: Node,
    kind: Any,
    topic: str,
    profile: QoSProfile,
    received: Callable[[Any], None],
    warn: Callable[[str, str], object],
    *,
    events: SubscriptionEventCallbacks | None = None,
) -> Subscription:
    """
    Make a subscription to messages of a kind.

    What a process that was killed has left half written cannot be read.  Fast DDS 2.14 tries so
    for ever, with the interpreter's lock held, unless it is asked for the bytes alone.

    :param received: called with every message.
    :param warn: called with a key and a text if a message cannot be read, which is ignored, or,
        without ``events``, if a publisher offers less than is asked for.
    :param events: of a subscription whose reliability has a parameter of its own, and changes.
    """
    # All that the subscriptions of this package ask for.
    latched = profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
    wanted = 'it must be reliable' + ' and transient local' * latched
    usual = SubscriptionEventCallbacks(
        incompatible_qos=lambda event: warn(topic, incompatible(topic, event, wanted)),
        use_default_callbacks=False,
    )

    def deliver(data: bytes) -> None:
        try:
            message = deserialize_message(data, kind)
        except rclpy_implementation.RMWError:
            warn(
                f'{topic} cut off',
                f'a message on {topic} was cut off, perhaps by the end of the process that sent '
                'it: it is ignored',
            )
            return
        received(message)

    return node.create_subscription(
        kind,
        topic,
        deliver,
        copy(profile),
        raw=True,
        event_callbacks=events or usual,
        qos_overriding_options=QoSOverridingOptions(_OVERRIDABLE[: 2 if events else 3]),
    )


def incompatible(topic: str, event: QoSRequestedIncompatibleQoSInfo, remedy: str) -> str:
    """Return what to say of a publisher that offers less than is asked for, and what helps."""
    policy = qos_policy_name_from_kind(event.last_policy_kind)
    return (
        f'a publisher on {topic} offers an incompatible QoS ({policy}); no messages come from it: '
        + remedy
    )
