# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Publishers and subscriptions, their QoS, and what rclpy refuses."""

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
from rclpy.publisher import Publisher
from rclpy.qos import (
    DurabilityPolicy,
    QoSPolicyKind,
    QoSProfile,
    ReliabilityPolicy,
    qos_policy_name_from_kind,
)
from rclpy.qos_overriding_options import QoSOverridingOptions
from sensor_msgs.msg import CompressedImage, Image

from gait_segmentation.streams.config import CameraConfig
from gait_segmentation.streams.fields import DEPTH

BETWEEN_NODES = QoSProfile(depth=DEPTH)
"""Reliable: of all that the nodes publish, and of what they receive from each other."""

BEST_EFFORT = QoSProfile(depth=DEPTH, reliability=ReliabilityPolicy.BEST_EFFORT)
"""Of subscriptions that take what others publish, however they do it."""

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""Of what is published once and must reach those who come later."""

_OVERRIDABLE = (QoSPolicyKind.HISTORY, QoSPolicyKind.DEPTH, QoSPolicyKind.RELIABILITY)
"""What parameters of the kind ``qos_overrides`` may change."""


def publisher(node: Any, kind: Any, topic: str, profile: QoSProfile) -> Publisher:
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


def subscribe(
    node: Any,
    kind: Any,
    topic: str,
    received: Callable[[Any], None],
    profile: QoSProfile = BETWEEN_NODES,
) -> None:
    """
    Subscribe until the deactivation of a :class:`GaitNode`, which warns of what cannot come.

    :param received: called with every message.
    """

    def incompatible(event: QoSRequestedIncompatibleQoSInfo) -> None:
        policy = qos_policy_name_from_kind(event.last_policy_kind)
        latched = profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
        node.warnings.warn(
            topic,
            f'a publisher on {topic} offers an incompatible QoS ({policy}); no messages come from '
            'it: it must be reliable' + ' and transient local' * latched,
        )

    def lost(event: QoSMessageLostInfo) -> None:
        node.statistics.lost += event.total_count_change
        node.warnings.warn_of(
            event.total_count_change,
            '{} lost on the way: start the camera with FASTRTPS_DEFAULT_PROFILES_FILE set to '
            'config/fastdds_shm.xml of this package (here it does not help), or set reliability '
            'to reliable, or image_transport to compressed',
        )

    made = node.create_subscription(
        kind,
        topic,
        received,
        copy(profile),
        event_callbacks=SubscriptionEventCallbacks(
            incompatible_qos=incompatible,
            # Of frames, which are counted.
            message_lost=lost if topic == node.camera_topic else None,
            use_default_callbacks=False,
        ),
        qos_overriding_options=QoSOverridingOptions(_OVERRIDABLE),
    )
    node.inputs.append(lambda: node.destroy_subscription(made))


def camera_input(node: Any, config: CameraConfig) -> tuple[Any, str, QoSProfile]:
    """
    Return type, topic and QoS of the images of a camera.

    Compressed ones are on the topic that ``image`` is remapped to, with ``/compressed`` behind it,
    as image_transport has it.
    """
    profile = BETWEEN_NODES if config.reliability == 'reliable' else BEST_EFFORT
    if config.image_transport == 'raw':
        return Image, 'image', profile
    return CompressedImage, f'{node.resolve_topic_name("image")}/compressed', profile


def said_by(error: Exception) -> str:
    """Return what an error of rclpy says, without the name it points to a place in."""
    return str(error).partition('\n')[0].rstrip(':')
