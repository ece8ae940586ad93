# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Publishers and subscriptions whose QoS can be overridden, and that cost the executor little."""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from typing import Any

from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_policy_name_from_kind
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.serialization import deserialize_message
from rclpy.subscription import Subscription

__all__ = ['from_bytes', 'publisher', 'subscription']


def publisher(node: Node, kind: Any, topic: str, profile: QoSProfile) -> Publisher:
    """Make a publisher of messages of a kind."""
    return node.create_publisher(
        kind,
        topic,
        # A copy, because overrides are written into it.
        copy(profile),
        # Every event that could be reported costs the executor time in every round.
        event_callbacks=PublisherEventCallbacks(use_default_callbacks=False),
        qos_overriding_options=QoSOverridingOptions.with_default_policies(),
    )


def subscription(
    node: Node,
    kind: Any,
    topic: str,
    profile: QoSProfile,
    received: Callable[[Any], None],
    warn: Callable[[str, str], object],
) -> Subscription:
    """
    Make a subscription to messages of a kind.

    :param received: called with every message.
    :param warn: called with a key and a text if a publisher offers less than is asked for.
    """
    # All that the subscriptions of this package ask for.
    latched = profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
    wanted = 'reliable and transient local' if latched else 'reliable'
    events = SubscriptionEventCallbacks(
        incompatible_qos=lambda event: warn(
            topic,
            f'a publisher on {topic} offers an incompatible QoS '
            f'({qos_policy_name_from_kind(event.last_policy_kind)}); no messages come from it: it '
            f'must be {wanted}',
        ),
        use_default_callbacks=False,
    )
    return node.create_subscription(
        kind,
        topic,
        from_bytes(kind, topic, received, warn),
        copy(profile),
        raw=True,
        event_callbacks=events,
        qos_overriding_options=QoSOverridingOptions.with_default_policies(),
    )


def from_bytes(
    kind: Any,
    topic: str,
    received: Callable[[Any], None],
    warn: Callable[[str, str], object],
) -> Callable[[bytes], None]:
    """
    Return the callback of a raw subscription, which gives messages of a kind to another.

    What a process that was killed has left half written cannot be read.  Fast DDS 2.14 tries so
    for ever, with the interpreter's lock held, unless it is asked for the bytes alone.

    :param warn: called with a key and a text if a message cannot be read, which is ignored.
    """

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

    return deliver
