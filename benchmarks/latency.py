#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Latency from a frame's stamp to its mask over DDS, as somebody who subscribes to the mask sees it.

A synthetic walker, 0.62 of the image high, walks to and fro before gait_source, which publishes
at 30 frames per second as a camera does; the three nodes (split) or gait_pipeline (single) run
with their defaults in processes of their own.  Needs ROS 2; leave the machine alone meanwhile::

    python benchmarks/latency.py [--seconds 60] [--sizes 640x480 1280x720] [--json FILE]
        [--plot docs/images/latency.png]

Latencies in ms are over all frames answered; ``lost`` counts frames without a mask that were
published after the first second, ``lost_first_second`` those before, ``first`` is the latency of
the first frame of all.  ``cpu_percent`` (of one core, the source not counted) and ``rss_mib`` are
of all nodes together.  ``--json`` has split and single of the first size at the top, and all
sizes under their names.
"""

from __future__ import annotations

import argparse
import json
import os
import struct
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from gait_segmentation.cli.demo import NODES, prepare_environment, read_stamps
from gait_segmentation.cli.processes import ProcessError, ProcessGroup
from gait_segmentation.cli.tool import run_tool
from gait_segmentation.geometry import Box

MODULES = {
    'gait_tracker': 'gait_segmentation.nodes.tracker_node',
    'gait_matcher': 'gait_segmentation.nodes.matcher_node',
    'gait_segmenter': 'gait_segmentation.nodes.segmenter_node',
    'gait_pipeline': 'gait_segmentation.nodes.pipeline_node',
}
STYLES = {'split': NODES, 'single': ('gait_pipeline',)}

LINKS = {'box': 1, 'likelihood': 2, 'matched_box': 2, 'shape_prior': 2, 'mask': 1}
"""Subscribers that the topics of a person have when the three nodes are connected."""

BARS = {
    ('640x480', 'split'): {'p95': 33.0, 'lost': 0, 'cpu_percent': 100.0, 'first': 100.0},
    ('640x480', 'single'): {'p95': 20.0, 'lost': 0, 'first': 100.0},
    ('1280x720', 'split'): {'p95': 50.0, 'lost': 0},
}
PERSON = 0.62
STEPS = 60
START_TIMEOUT_S, FLOW_OUT_S, POLL_S = 120.0, 3.0, 0.02
STAMP = struct.Struct('=4xiI')
"""Of a serialised message that begins with a header, in the byte order that DDS uses here."""


def size_of(text: str) -> tuple[int, int]:
    """Read a size such as 640x480."""
    try:
        width, height = (int(part) for part in text.split('x'))
    except ValueError:
        raise argparse.ArgumentTypeError(f'{text} is no size such as 640x480') from None
    return width, height


def write_clip(folder: Path, size: tuple[int, int], count: int) -> Box:
    """Write ``count`` frames of somebody who walks to and fro; return the first box."""
    import cv2

    from benchmarks.synthetic import SyntheticConfig, SyntheticSequence

    clip = SyntheticSequence(
        SyntheticConfig(
            width=size[0],
            height=size[1],
            frames=STEPS,
            fps=30.0,
            person_height=PERSON * size[1],
            jitter=0.0,
            clutter=0.7,
        )
    )
    for frame in clip:
        # Uncompressed, so that decoding does not compete with the nodes.
        cv2.imwrite(str(folder / f'once{frame.number:03d}.bmp'), frame.image)
    shown = folder / 'frames'
    shown.mkdir()
    there_and_back = [*range(STEPS), *range(STEPS - 2, 0, -1)]
    for number in range(count):
        step = there_and_back[number % len(there_and_back)]
        (shown / f'{number:06d}.bmp').symlink_to(folder / f'once{step:03d}.bmp')
    assert clip.initial_box is not None
    return clip.initial_box


class Listener:
    """Subscribes to the mask, as a user would, and to the diagnostics."""

    def __init__(self) -> None:
        from diagnostic_msgs.msg import DiagnosticArray
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.node import Node
        from rclpy.qos import QoSProfile
        from sensor_msgs.msg import Image

        self.arrived: dict[int, float] = {}
        self._active: set[str] = set()
        self._subscribers: dict[str, int] = {}
        self._node = Node('latency')
        # Raw: reading the pixels would take time from the nodes.
        self._node.create_subscription(
            Image, 'mask', self._receive, QoSProfile(depth=50), raw=True
        )
        self._node.create_subscription(DiagnosticArray, '/diagnostics', self._diagnose, 10)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._node)
        self._thread = threading.Thread(target=self._executor.spin, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop listening."""
        self._executor.shutdown()
        self._thread.join()
        self._node.destroy_node()

    def connected(self, nodes: tuple[str, ...]) -> bool:
        """Tell whether the nodes are active and connected."""
        wanted = {'/mask': 1}
        if len(nodes) > 1:
            wanted |= {f'/person_0/{topic}': count for topic, count in LINKS.items()}
        return set(nodes) <= self._active and all(
            self._subscribers.get(topic, 0) >= count for topic, count in wanted.items()
        )

    def _receive(self, data: bytes) -> None:
        now = time.time()
        seconds, nanoseconds = STAMP.unpack_from(data)
        self.arrived.setdefault(seconds * 1_000_000_000 + nanoseconds, now)

    def _diagnose(self, message: Any) -> None:
        prefix = 'subscribers of '
        for status in message.status:
            for each in status.values:
                if each.key.startswith(prefix):
                    self._subscribers[each.key.removeprefix(prefix)] = int(each.value)
                elif each.key == 'state' and each.value == 'active':
                    self._active.add(status.name.strip('/'))


def processor_seconds(pid: int) -> float:
    """Return the processor time a process has taken."""
    fields = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')


def resident_mib(pid: int) -> float:
    """Return the resident memory of a process."""
    pages = int(Path(f'/proc/{pid}/statm').read_text().split()[1])
    return pages * os.sysconf('SC_PAGE_SIZE') / 2**20


def start(
    processes: ProcessGroup,
    nodes: tuple[str, ...],
    listener: Listener,
    *parameters: str,
    box: Box | None = None,
) -> None:
    """
    Start nodes and wait until they are active and connected.

    :param parameters: of all nodes, as ``name:=value``.
    :param box: of a person in the first frame; without, people are found.
    """
    for name in nodes:
        given = list(parameters)
        if box is not None and name in ('gait_tracker', 'gait_pipeline'):
            numbers = f'{box.x:.2f}, {box.y:.2f}, {box.width:.2f}, {box.height:.2f}'
            given.append(f'initial_box:=[{numbers}]')
        words = [word for each in given for word in ('-p', each)]
        processes.start(name, MODULES[name], '--ros-args', *words)
    deadline = time.monotonic() + START_TIMEOUT_S
    while not listener.connected(nodes):
        processes.check_running(*nodes)
        if time.monotonic() > deadline:
            raise ProcessError('the nodes did not connect')
        time.sleep(POLL_S)


def run(
    style: str, frames: Path, box: Box, rate: float
) -> tuple[dict[int, int], dict[int, float], float, float]:
    """
    Play the frames once.

    :returns: stamps by number, arrivals by stamp, share of a core, and memory in MiB.
    """
    import rclpy
    from rclpy.signals import SignalHandlerOptions

    nodes = STYLES[style]
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    try:
        with (
            tempfile.TemporaryDirectory() as logs,
            ProcessGroup(os.environ, Path(logs)) as processes,
        ):
            listener = Listener()
            try:
                start(processes, nodes, listener, box=box)
                stamps = Path(logs) / 'stamps.txt'
                processes.start(
                    'gait_source', 'gait_segmentation.nodes.source_node', str(frames),
                    '--rate', str(rate), '--wait-for', str(min(len(nodes), 2)),
                    '--delay', '1', '--stamps', str(stamps),
                )  # fmt: skip
                while not (listener.arrived or processes.ended('gait_source')):
                    time.sleep(POLL_S)
                pids = [processes.pid(name) for name in nodes]
                began, used = time.monotonic(), sum(map(processor_seconds, pids))
                while not processes.ended('gait_source'):
                    processes.check_running(*nodes)
                    time.sleep(10 * POLL_S)
                passed = time.monotonic() - began
                used = sum(map(processor_seconds, pids)) - used
                memory = sum(map(resident_mib, pids))
                time.sleep(FLOW_OUT_S)
            finally:
                listener.close()
            return read_stamps(stamps), dict(listener.arrived), used / max(passed, 1e-9), memory
    finally:
        rclpy.try_shutdown()


def measure(style: str, size: tuple[int, int], seconds: float, rate: float) -> dict[str, Any]:
    """Measure one style at one size."""
    import numpy as np

    with tempfile.TemporaryDirectory() as folder:
        box = write_clip(Path(folder), size, max(2, round(seconds * rate)))
        stamps, arrived, share, memory = run(style, Path(folder) / 'frames', box, rate)
    published = sorted(stamps.values())
    if not published or not arrived:
        raise ProcessError(f'{style}: {len(published)} frames published, none answered')
    latency = {t: 1e3 * (arrived[t] - t / 1e9) for t in published if t in arrived}
    missing = [t for t in published if t not in arrived]
    settled = published[0] + 1_000_000_000
    values = np.array(list(latency.values()))
    found = {f'p{share}': round(float(np.percentile(values, share)), 2) for share in (50, 95, 99)}
    late = [value for stamp, value in latency.items() if stamp >= settled]
    return found | {
        'max': round(float(values.max()), 2),
        'lost': sum(t >= settled for t in missing),
        'cpu_percent': round(100 * share, 1),
        'rss_mib': round(memory, 1),
        'frames': len(published),
        'answered': len(latency),
        'lost_first_second': sum(t < settled for t in missing),
        'first': round(latency.get(published[0], float('inf')), 2),
        'max_after_first_second': round(max(late, default=0.0), 2),
        'over_time': [
            [round((t - published[0]) / 1e9, 3), round(v, 2)] for t, v in latency.items()
        ],
    }


def plot(report: dict[str, dict[str, dict[str, Any]]], path: Path) -> None:
    """Draw the share of frames answered within a time."""
    import matplotlib

    matplotlib.use('Agg')
    import matplotlib.pyplot as plt
    import numpy as np

    figure, axis = plt.subplots(figsize=(5.2, 3.2))
    for size, styles in report.items():
        for style, found in styles.items():
            values = np.sort([value for _, value in found['over_time']])
            share = np.arange(1, len(values) + 1) / found['frames']
            axis.step(values, 100 * share, label=f'{style}, {size}')
    axis.set_xlabel('ms from stamp to mask')
    axis.set_ylabel('% of frames')
    axis.set_xlim(left=0)
    axis.grid(alpha=0.3)
    axis.legend(fontsize=7, loc='lower right')
    figure.tight_layout()
    figure.savefig(path, dpi=80)


def main() -> int:
    """Measure, print, and say whether what is promised holds."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = parser.add_argument
    add('--sizes', type=size_of, nargs='+', default=[(640, 480)], metavar='WxH')
    add('--styles', nargs='+', choices=list(STYLES), default=list(STYLES))
    add('--rate', type=float, default=30.0, metavar='HZ')
    add('--seconds', type=float, default=60.0)
    add('--json', type=Path, metavar='FILE', help='write the figures here')
    add('--plot', type=Path, metavar='FILE', help='draw the distribution of the latency')
    options = parser.parse_args()
    prepare_environment(os.environ)
    report: dict[str, dict[str, dict[str, Any]]] = {}
    fine = True
    for size in options.sizes:
        name = f'{size[0]}x{size[1]}'
        report[name] = {}
        for style in options.styles:
            found = measure(style, size, options.seconds, options.rate)
            report[name][style] = found
            print(
                f'{name} {style:6s}', *(f'{k} {v}' for k, v in found.items() if k != 'over_time')
            )
            for key, limit in BARS.get((name, style), {}).items():
                holds = found[key] <= limit
                fine &= holds
                print(
                    f'{"ok  " if holds else "MISS"} {key}: {found[key]} <= {limit:g}', flush=True
                )
    if options.plot:
        plot(report, options.plot)
    if options.json:
        for styles in report.values():
            for found in styles.values():
                del found['over_time']
        first = report[next(iter(report))]
        options.json.write_text(json.dumps(first | report, indent=1) + '\n')
    return 0 if fine else 1


if __name__ == '__main__':
    sys.exit(run_tool('latency.py', main))
