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
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from gait_segmentation.streams.config import NODES, CameraConfig

_LATE_MS = 250.0
"""Latency (95th percentile) above which a node warns."""

_QUIET_S = 3.0
"""Time without input after which a node is stale."""

_PATIENCE_S = 10.0
"""Time without input after which it is logged what is missing."""

_RAW, _COMPRESSED = 'sensor_msgs/msg/Image', 'sensor_msgs/msg/CompressedImage'
_SUFFIX = '/compressed'

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
        self._told = (0, 0)
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

    def losses(self) -> tuple[int, int]:
        """Return the frames dropped or stale, and those that failed, since last asked."""
        now = (self.dropped + self.stale, self.failed)
        before, self._told = self._told, now
        return now[0] - before[0], now[1] - before[1]

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
        now_s = time.monotonic()
        self._publisher.publish(self.message(now_s, self._now(), self._missing(now_s)))

    def message(self, now_s: float, now: Time, missing: str = '') -> DiagnosticArray:
        """Describe how the node is doing, at a steady time, and what it misses if it is stale."""
        node, statistics = self._node, self._node.statistics
        name, details = node.get_fully_qualified_name().strip('/'), node.status()
        (median, high), (frames, outputs) = statistics.latency_ms(), statistics.rates_hz(now_s)
        age_s = (now.sec * 10**9 + now.nanosec - statistics.last_stamp_ns) / 1e9
        dated = statistics.last_stamp_ns > 0 and (now.sec, now.nanosec) > (0, 0) and age_s >= 0
        counts = ('received', 'processed', 'dropped', 'stale', 'failed')
        values = {
            'state': node.state if node.enabled else f'{node.state}, disabled',
            'input rate (Hz)': f'{frames:.1f}',
            'output rate (Hz)': f'{outputs:.1f}',
            **{each: str(getattr(statistics, each)) for each in counts},
            'latency p50 (ms)': f'{median:.1f}',
            'latency p95 (ms)': f'{high:.1f}',
            'age of the last stamp (s)': f'{age_s if dated else math.nan:.3f}',
            **details,
            'kernels ready': str(node.stage is not None).lower(),
        }
        for output in node.outputs:
            values[f'subscribers of {output.topic_name}'] = str(output.get_subscription_count())
        level, text = self._judged(values['state'], now_s, missing)
        status = DiagnosticStatus(level=level, name=name, message=text)
        status.hardware_id = details.get('camera', name)
        status.values = [KeyValue(key=key, value=value) for key, value in values.items()]
        message = DiagnosticArray(status=[status])
        message.header.stamp = now
        return message

    def _judged(self, state: str, now_s: float, missing: str) -> tuple[bytes, str]:
        """Return the level and what it is for; nothing is expected of who is not active."""
        statistics, trouble = self._node.statistics, self._node.trouble
        losses, failures = statistics.losses()
        quiet_s, late_ms = statistics.quiet_s(now_s), statistics.latency_ms()[1]
        if state == 'active' and (twice := published_twice(self._node)):
            self._node.warnings.warn('twice', twice)
            return DiagnosticStatus.WARN, twice
        if state == 'active' and quiet_s > _QUIET_S:
            text = f'no input for {quiet_s:.0f} s'
            return DiagnosticStatus.STALE, text + f': {missing}' * bool(missing)
        if state == 'active' and not statistics.received:
            return DiagnosticStatus.OK, 'active, no input yet'
        if failures:
            trouble = f'{failures} frames could not be used since the last report'
        elif losses:
            trouble = f'{losses} frames dropped or stale since the last report'
        elif late_ms > _LATE_MS:
            trouble = f'slow: 95 % of the outputs within {late_ms:.0f} ms'
        return (DiagnosticStatus.WARN, trouble) if trouble else (DiagnosticStatus.OK, state)

    def _now(self) -> Time:
        """Return the time of the node's clock, 0 while it is not known or below zero, and warn."""
        try:
            now = self._node.get_clock().now().to_msg()
        except ValueError:
            now = Time()
        if not (now.sec or now.nanosec) and self._node.statistics.received:
            self._node.warnings.warn(
                'no time',
                "the node's clock says nothing above zero, so ages of stamps are not known: with "
                'use_sim_time a node must publish on /clock',
            )
        return now

    def _missing(self, now_s: float) -> str:
        """Return what an active node has waited for in vain, and log it when it changes."""
        node = self._node
        waits = node.state == 'active' and node.enabled
        quiet_s = node.statistics.quiet_s(now_s) if waits else 0.0
        missing = shortened(missing_input(node)) if quiet_s > _QUIET_S else ''
        if not missing:
            self._said = ''
        elif quiet_s > _PATIENCE_S and missing != self._said:
            self._said = missing
            node.get_logger().warning(missing)
        return missing


def published_twice(node: Any) -> str:
    """Say which other node publishes what a GaitNode publishes, empty if none does."""
    for topic in (output.topic_name for output in node.outputs):
        if node.count_publishers(topic) < 2:
            continue
        found = [
            f'{each.node_namespace.rstrip("/")}/{each.node_name}'
            for each in node.get_publishers_info_by_topic(topic)
        ]
        own = node.get_fully_qualified_name()
        others = ' and '.join(sorted(set(found) - {own})) or f'another {own}'
        return (
            f'{others} publishes {topic}, too, so every frame has several answers: end it, or '
            'give one of both a namespace (what was killed stays in the graph for 20 s)'
        )
    return ''


def missing_input(node: Any) -> str:
    """Say what an active GaitNode lacks: stamps, or what its camera or other nodes publish."""
    sees = node.has(CameraConfig)
    if node.unstamped:
        return 'what comes has no stamp'
    if sees and not node.count_publishers(node.resolve_topic_name(node.camera_topic)):
        return no_images(node, node.camera_topic)
    for by, topics in node.topics.items():
        # To count publishers does not remap.
        names = map(node.resolve_topic_name, topics)
        if absent := [name for name in names if not node.count_publishers(name)]:
            lacking = ', '.join(sorted(absent))
            return f'nothing to do: no node publishes {lacking}; is {by} running and active?'
    waits_for = node.join and node.join.waits_for
    silent = waits_for or ('camera' if sees else next(iter(node.topics)))
    if silent == 'camera':
        return no_images(node, node.camera_topic)
    return (
        f'nothing to do: nothing comes from {silent}; is it active and enabled, and has it images?'
    )


def no_images(node: Node, topic: str) -> str:
    """Say why there are no images on a topic, raw or compressed, and where there are some."""
    name = node.resolve_topic_name(topic)
    compressed = topic.endswith(_SUFFIX)
    wanted, other = (_COMPRESSED, _RAW) if compressed else (_RAW, _COMPRESSED)
    kinds = sorted({each.topic_type for each in node.get_publishers_info_by_topic(name)})
    if wanted in kinds:
        return f'no images: {name} has a publisher, but nothing comes from it'
    if kinds:
        return f'no images: what is published on {name} is {", ".join(kinds)}, not {wanted}'
    sibling = name.removesuffix(_SUFFIX) if compressed else name + _SUFFIX
    if _from_cameras(node, sibling, other):
        way = 'raw' if compressed else 'compressed'
        return (
            f'no images: no node publishes {name}, but {sibling} is: set image_transport to {way}'
        )
    topics = sorted(each for each, _ in node.get_topic_names_and_types())
    found = ', '.join(each for each in topics if _from_cameras(node, each, wanted))
    text = f'no images: no node publishes {name}'
    if not found:
        return f'{text}; start the camera, or remap image to its topic'
    return f'{text}, but there are images on {found}: remap image (image:=TOPIC)'


def _from_cameras(node: Node, name: str, kind: str) -> bool:
    """Return whether a node of another package publishes messages of a kind."""
    return any(
        each.topic_type == kind and each.node_name not in NODES
        for each in node.get_publishers_info_by_topic(name)
    )
