# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The subscription to a camera, which adapts to what the camera offers."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.qos import ReliabilityPolicy
from sensor_msgs.msg import CompressedImage, Image

from gait_segmentation.ros.endpoints import (
    BEST_EFFORT,
    BETWEEN_NODES,
    incompatible,
    subscription,
)

if TYPE_CHECKING:
    from rclpy.event_handler import QoSMessageLostInfo, QoSRequestedIncompatibleQoSInfo

    from gait_segmentation.ros.lifecycle import GaitNode
    from gait_segmentation.streams.config import CameraConfig


class CameraSubscription:
    """
    A subscription to images, or to what is said of them, that adapts to what the camera offers.

    With ``reliability: auto`` it asks for reliable delivery; if a camera offers only best
    effort, it says so once and is made anew as best effort.
    """

    def __init__(
        self,
        node: GaitNode,
        config: CameraConfig,
        received: Callable[[Any], None],
        topic: str = 'image',
        kind: Any = Image,
    ) -> None:
        """
        Subscribe.

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
        self._subscription = subscription(
            self._node,
            self._type,
            self.topic,
            BEST_EFFORT if best_effort else BETWEEN_NODES,
            self._received,
            self._node.warnings.warn,
            events=events,
        )

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
            self._node.warnings.warn(name, incompatible(name, event, remedy))

    def _renew(self) -> None:
        if not self.best_effort:
            self._node.destroy_subscription(self._subscription)
            self._subscribe(best_effort=True)
