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
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    QoSProfile,
    ReliabilityPolicy,
    qos_policy_name_from_kind,
)
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.serialization import deserialize_message
from rclpy.subscription import Subscription

from gait_segmentation.ros.fields import DEPTH

__all__ = ['BETWEEN_NODES', 'LATCHED', 'image_profile', 'publisher', 'subscription']

BETWEEN_NODES = QoSProfile(
    history=HistoryPolicy.KEEP_LAST,
    depth=DEPTH,
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
        depth=DEPTH,
        reliability=(ReliabilityPolicy.BEST_EFFORT if best_effort else ReliabilityPolicy.RELIABLE),
        durability=DurabilityPolicy.VOLATILE,
    )


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
    *,
    events: SubscriptionEventCallbacks | None = None,
    overridable: QoSOverridingOptions | None = None,
) -> Subscription:
    """
    Make a subscription to messages of a kind.

    :param received: called with every message.
    :param warn: called with a key and a text if a message cannot be read, or, without ``events``,
        if a publisher offers less than is asked for.
    :param overridable: what of the QoS parameters may override, if not the usual.
    """
    # All that the subscriptions of this package ask for.
    latched = profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
    wanted = 'reliable and transient local' if latched else 'reliable'
    usual = SubscriptionEventCallbacks(
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
        _from_bytes(kind, topic, received, warn),
        copy(profile),
        raw=True,
        event_callbacks=events or usual,
        qos_overriding_options=overridable or QoSOverridingOptions.with_default_policies(),
    )


def _from_bytes(
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
