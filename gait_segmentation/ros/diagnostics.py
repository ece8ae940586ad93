# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How a node is doing, what it says of that, and of what it waits for in vain."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.clock import Clock, ClockType

from gait_segmentation.streams.config import NODES, CameraConfig

_QUIET_S = 3.0
"""Time without input after which a node is stale."""

_PATIENCE_S = 10.0
"""Time without input after which it is logged what is missing."""

_IMAGES = ('sensor_msgs/msg/Image', 'sensor_msgs/msg/CompressedImage')

_WINDOW = 150
"""Frames that rates and latencies are taken over."""

_RECENT_S = 5.0
"""Time that rates are taken over."""

_EVERY_S = 10.0

_LONGEST = 400
"""Characters of a line: names and numbers in messages may be of any length."""


class Statistics:
    """What is known of the frames of a node; times are seconds of any steady clock."""

    def __init__(self) -> None:
        """Begin with nothing received."""
        self.received = self.processed = self.failed = self.dropped = self.stale = 0
        self.last_stamp_ns = 0
        self._arrivals: deque[float] = deque(maxlen=_WINDOW)
        self._departures: deque[float] = deque(maxlen=_WINDOW)
        self._latencies_s: deque[float] = deque(maxlen=_WINDOW)
        self._since_s = math.nan

    def arrived(self, now_s: float, stamp_ns: int) -> None:
        """Count a frame received."""
        self.received += 1
        self.last_stamp_ns = stamp_ns
        self._arrivals.append(now_s)

    def finished(self, latency_s: float, now_s: float = 0.0) -> None:
        """Count a frame whose output is published, ``latency_s`` after its arrival."""
        self.processed += 1
        self._latencies_s.append(latency_s)
        self._departures.append(now_s)

    def rates_hz(self, now_s: float) -> tuple[float, float]:
        """Return the rates of frames and of outputs over the last 5 seconds, 0 without."""

        def rate(all_times: deque[float]) -> float:
            times = [each for each in list(all_times) if now_s - each <= _RECENT_S]
            if not times or times[-1] <= times[0]:
                return 0.0
            return (len(times) - 1) / (times[-1] - times[0])

        return rate(self._arrivals), rate(self._departures)

    def expect(self, now_s: float) -> None:
        """Note that frames are to come from now on."""
        self._since_s = now_s

    def quiet_s(self, now_s: float) -> float:
        """Return the time for which frames were to come and none did, NaN if none are to."""
        last_s = self._arrivals[-1] if self._arrivals else math.nan
        # NaN gives way to the other.
        return now_s - float(np.fmax(last_s, self._since_s))

    def latency_ms(self) -> tuple[float, float]:
        """Return median and 95th percentile of the time from arrival to output, NaN without."""
        median, high = np.percentile(list(self._latencies_s) or [math.nan], (50, 95)) * 1e3
        return float(median), float(high)


def shortened(text: str) -> str:
    """Return a text as far as a line of a log should hold it."""
    return text if len(text) <= _LONGEST else f'{text[:_LONGEST]} ... ({len(text)} characters)'


class Warnings:
    """The warnings of a node, of which those of one key are logged at most every 10 seconds."""

    def __init__(self, log: Callable[[str], object], clock: Callable[[], float]) -> None:
        """Begin with nothing said; ``log`` takes texts, ``clock`` is steady and in seconds."""
        self._log = log
        self._clock = clock
        self.said_s: dict[str, float] = {}
        """When something was last logged of a key."""

    def warn(self, key: str, text: str) -> None:
        """Log a warning unless one of its key was logged just before."""
        now_s = self._clock()
        if now_s - self.said_s.get(key, -_EVERY_S) >= _EVERY_S:
            self.said_s[key] = now_s
            self._log(shortened(text))


class Diagnostics:
    """Reports on a node once a second, and logs what it lacks."""

    def __init__(self, node: Any) -> None:
        """Begin to report on a :class:`GaitNode`."""
        self._node = node
        self._said = ''
        self._publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 10)
        # Steady, so that a simulation that stands still is still reported on.
        node.create_timer(1.0, self.report, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def report(self) -> None:
        """Publish a report, or raise in the executor's thread what has ended the worker's."""
        if self._node.failure is not None:
            raise self._node.failure
        message = DiagnosticArray(status=[self.status(time.monotonic())])
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(message)

    def status(self, now_s: float) -> DiagnosticStatus:
        """Describe how the node is doing at a steady time, and log what it waits for in vain."""
        node, values = self._node, self._values(now_s)
        text, missing = node.trouble or values['state'], ''
        level = DiagnosticStatus.WARN if node.trouble else DiagnosticStatus.OK
        took_s, step_s = node.frame_times_s
        if took_s > step_s > 0:
            text = (
                f'{text}: frames take {1e3 * took_s:.0f} ms and come every {1e3 * step_s:.0f}, so '
                'some are dropped; less work: a lower max_people, detector.network: boxes, a '
                'lower tracking.working_height, smaller images'
            )
        # Nothing is expected of who is not active.
        if values['state'] == 'active':
            quiet_s = node.statistics.quiet_s(now_s)
            if quiet_s > _QUIET_S:
                missing = shortened(missing_input(node))
                level, text = DiagnosticStatus.STALE, f'no input for {quiet_s:.0f} s: {missing}'
                if quiet_s > _PATIENCE_S and missing != self._said:
                    self._said = missing
                    node.get_logger().warning(missing)
            if twice := published_twice(node):
                level, text = DiagnosticStatus.WARN, twice
                node.warnings.warn('twice', twice)
        if not missing:
            self._said = ''
        name = node.get_fully_qualified_name().strip('/')
        return DiagnosticStatus(
            level=level,
            name=name,
            message=text,
            hardware_id=values.get('camera', name),
            values=[KeyValue(key=key, value=value) for key, value in values.items()],
        )

    def _values(self, now_s: float) -> dict[str, str]:
        node, statistics = self._node, self._node.statistics
        (median, high), (frames, outputs) = statistics.latency_ms(), statistics.rates_hz(now_s)
        counts = ('received', 'processed', 'dropped', 'stale', 'failed')
        return {
            'state': node.state if node.enabled else f'{node.state}, disabled',
            'input rate (Hz)': f'{frames:.1f}',
            'output rate (Hz)': f'{outputs:.1f}',
            **{each: str(getattr(statistics, each)) for each in counts},
            'latency p50 (ms)': f'{median:.1f}',
            'latency p95 (ms)': f'{high:.1f}',
            'time of a frame (ms)': f'{1e3 * node.frame_times_s[0]:.1f}',
            'last stamp (s)': f'{statistics.last_stamp_ns / 1e9:.3f}',
            **node.status(),
            'kernels ready': str(node.stage is not None).lower(),
            **{
                f'subscribers of {each.topic_name}': str(each.get_subscription_count())
                for each in node.outputs
            },
        }


def published_twice(node: Any) -> str:
    """Say which other node publishes what a GaitNode publishes, empty if none does."""
    own = node.get_fully_qualified_name()
    for topic in (output.topic_name for output in node.outputs):
        if node.count_publishers(topic) > 1:
            found = {
                f'{each.node_namespace.rstrip("/")}/{each.node_name}'
                for each in node.get_publishers_info_by_topic(topic)
            }
            others = ' and '.join(sorted(found - {own})) or f'another {own}'
            return (
                f'{others} publishes {topic}, too, so every frame has several answers: end it, or '
                'give one of both a namespace (what was killed stays in the graph for 20 s)'
            )
    return ''


def missing_input(node: Any) -> str:
    """Say what an active GaitNode lacks: stamps, what other nodes publish, or images."""
    if node.unstamped:
        return 'what comes has no stamp'
    for by, topics in node.topics.items():
        # To count publishers does not remap.
        names = map(node.resolve_topic_name, topics)
        if absent := [name for name in names if not node.count_publishers(name)]:
            lacking = ', '.join(sorted(absent))
            return f'nothing to do: no node publishes {lacking}; is {by} running and active?'
    waits_for = node.join and node.join.waits_for
    silent = waits_for or ('camera' if node.has(CameraConfig) else next(iter(node.topics)))
    if silent != 'camera':
        return f'nothing comes from {silent}; is it active and enabled, and has it images?'
    found = sorted(
        f'{topic} ({each.topic_type})'
        for topic, _ in node.get_topic_names_and_types()
        for each in node.get_publishers_info_by_topic(topic)
        if each.topic_type in _IMAGES and each.node_name not in NODES
    )
    own, kind = node.resolve_topic_name(node.camera_topic), _IMAGES[node.camera_topic != 'image']
    text = f'no images come on {own}'
    if not found:
        return f'{text}: start the camera, or remap image to its topic'
    if f'{own} ({kind})' in found:
        return (
            f'{text}, though a node publishes there: it sends none, its QoS does not fit, or '
            'large images are lost on the way, see docs/ros_troubleshooting.md'
        )
    there = ', '.join(found)
    return f'{text}, there are {there}: remap image (image:=TOPIC), or set image_transport'
