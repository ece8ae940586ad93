# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Publishers, subscriptions and services: their QoS, and what keeps the odd from ending a node."""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from functools import partial
from typing import Any

from rclpy.event_handler import (
    PublisherEventCallbacks,
    QoSMessageLostInfo,
    QoSRequestedIncompatibleQoSInfo,
    SubscriptionEventCallbacks,
)
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
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CompressedImage, Image

from gait_segmentation.streams.config import CameraConfig
from gait_segmentation.streams.fields import DEPTH

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
        incompatible_qos=lambda event: warn(topic, _incompatible(topic, event, wanted)),
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


def _incompatible(topic: str, event: QoSRequestedIncompatibleQoSInfo, remedy: str) -> str:
    policy = qos_policy_name_from_kind(event.last_policy_kind)
    return (
        f'a publisher on {topic} offers an incompatible QoS ({policy}); no messages come from it: '
        + remedy
    )


class CameraSubscription:
    """
    A subscription to images, or to what is said of them, that adapts to what the camera offers.

    With ``reliability: auto`` it asks for reliable delivery; if a camera offers only best
    effort, it says so once and is made anew as best effort.
    """

    def __init__(
        self,
        node: Any,
        config: CameraConfig,
        received: Callable[[Any], None],
        topic: str = 'image',
        kind: Any = Image,
    ) -> None:
        """
        Subscribe, until the node's deactivation.

        :param node: a :class:`GaitNode`, whose statistics and warnings tell of what is lost.
        :param received: called with every message.
        :param kind: of the messages, if they are no images: of those the configuration says it.
        """
        compressed = kind is Image and config.image_transport == 'compressed'
        self._node = node
        self._type = CompressedImage if compressed else kind
        self.topic = f'{topic}/compressed' if compressed else topic
        self._received = received
        self._adapts = config.reliability == 'auto'
        self._renewal = node.create_guard_condition(self._renew)
        node.inputs.append(self.close)
        self._subscribe(best_effort=config.reliability == 'best_effort')

    @property
    def best_effort(self) -> bool:
        """Return whether messages may be lost on the way."""
        return bool(self._subscription.qos_profile.reliability == ReliabilityPolicy.BEST_EFFORT)

    def close(self) -> None:
        """Unsubscribe."""
        self._node.destroy_subscription(self._subscription)
        self._node.destroy_guard_condition(self._renewal)

    def _subscribe(self, best_effort: bool) -> None:
        events = SubscriptionEventCallbacks(
            incompatible_qos=self._offered_less,
            # Of frames, which are counted.
            message_lost=self._lost if self._type in (Image, CompressedImage) else None,
            use_default_callbacks=False,
        )
        profile = BEST_EFFORT if best_effort else BETWEEN_NODES
        about = self._node, self._type, self.topic, profile, self._received
        self._subscription = subscription(*about, self._node.warnings.warn, events=events)

    def _lost(self, event: QoSMessageLostInfo) -> None:
        self._node.statistics.lost += event.total_count_change
        remedies = [
            "start the camera's process with FASTRTPS_DEFAULT_PROFILES_FILE set to "
            'config/fastdds_shm.xml of this package (here it does not help)'
        ]
        if self._type is Image:
            remedies.append('or use image_transport compressed')
        if self.best_effort:
            remedies.append('or let the camera publish reliably')
        self._node.warnings.warn_of(
            event.total_count_change, '{} lost on the way: ' + ', '.join(remedies)
        )

    def _offered_less(self, event: QoSRequestedIncompatibleQoSInfo) -> None:
        name = self._subscription.topic_name
        if self._adapts and not self.best_effort:
            self._node.get_logger().info(
                f'the publisher on {name} offers best effort only: subscribing as best effort, '
                'messages may be lost'
            )
            # Not here: the executor is just calling this subscription's event.
            self._renewal.trigger()
        else:
            remedy = 'set the parameter reliability to auto or best_effort'
            self._node.warnings.warn(name, _incompatible(name, event, remedy))

    def _renew(self) -> None:
        if not self.best_effort:
            self._node.destroy_subscription(self._subscription)
            self._subscribe(best_effort=True)


def refuse_what_cannot_be_done(node: Node, warn: Callable[[str, str], object]) -> None:
    """
    Have a node refuse requests that rclpy raises an error for, which would end the node.

    Such are values of a type that there is not, and transitions that the state does not allow.

    :param warn: called with a key and a text.
    """
    for service in node.services:
        service.callback = partial(_answer, service.callback, service.srv_name, warn)


def _answer(
    answer: Callable[[Any, Any], Any],
    name: str,
    warn: Callable[[str, str], object],
    request: Any,
    response: Any,
) -> Any:
    try:
        return answer(request, response)
    except Exception as error:  # Of rclpy, which has many.
        warn(name, f'a request to {name} is refused: {error}')
        return response


def ignore_negative_times(node: Node, warn: Callable[[str, str], object]) -> None:
    """
    Have a node live on when a time below zero comes on /clock, which rclpy raises an error for.

    :param warn: called with a key and a text.
    """
    source = node._time_source
    take = source.clock_callback

    def received(message: Clock) -> None:
        if message.clock.sec < 0:
            seconds = message.clock.sec + message.clock.nanosec / 1e9
            warn('clock', f'the time {seconds:.9g} s on /clock is ignored: it is below zero')
            return
        take(message)

    source.clock_callback = received
    # With use_sim_time it has subscribed already.
    if source._clock_sub is not None:
        source._clock_sub.callback = received
