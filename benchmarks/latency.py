#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Latency from a frame's stamp to its mask over DDS, as somebody who subscribes to the mask sees it.

A synthetic walker, 0.62 of the image high, walks to and fro before gait_source, which publishes
at 30 frames per second as a camera does; the three nodes (split) or gait_pipeline (single) run
with their defaults, but for ``-p``, in processes of their own.  With ``--people`` they find people
by themselves in scenes of 640 x 480 in which these come, cross, go and come back, with a second of
nothing but noise between.  Needs ROS 2; leave the machine alone meanwhile::

    python benchmarks/latency.py [--seconds 60] [--sizes 640x480 1280x720] [--json FILE]
        [--plot docs/images/latency.png] [--rate 15] [-p matching.kernel:=direct_access_table ...]
    python benchmarks/latency.py --people 1 --styles single --seconds 1800
    python benchmarks/latency.py --heat-map 10

Latencies in ms are over all frames answered; ``lost`` counts frames without a mask that were
published after the first second, ``lost_first_second`` those before, ``first`` is the latency of
the first frame of all.  ``cpu_percent`` (of one core, the source not counted) and ``rss_mib`` are
of all nodes together; ``drift`` is the change of that memory over the last third, ``slower`` the
95th percentile of the last third over that of the first.  ``--json`` has split and single of the
first size at the top, and all sizes under their names.
"""

from __future__ import annotations

import argparse
import itertools
import json
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from rclpy.node import Node
from sensor_msgs.msg import Image

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.bars import holds
from benchmarks.nodes import (
    FLOW_OUT_S,
    STYLES,
    play,
    processor_seconds,
    resident_mib,
    session,
    start,
    wait,
    write_clip,
)
from benchmarks.synthetic.scenes import scene
from gait_segmentation.cli.live import read_stamps
from gait_segmentation.cli.processes import ProcessError
from gait_segmentation.cli.tool import run_tool

BARS = {
    ('640x480', 'split'): {'p95': 33.0, 'lost': 0, 'cpu_percent': 100.0, 'first': 100.0},
    ('640x480', 'single'): {'p95': 20.0, 'lost': 0, 'first': 100.0},
    ('1280x720', 'split'): {'p95': 50.0, 'lost': 0},
}
LONG = {'lost': 0, 'drift': 0.01, 'slower': 1.2}
"""Bars of the scenes with people who come and go."""

SCENES, NOISE_FRAMES = ('exit-enter', 'crossing', 'exit-return'), 30
SAMPLE_S = 0.2

Report = dict[str, dict[str, dict[str, Any]]]


def size_of(text: str) -> tuple[int, int]:
    """Read a size such as 640x480."""
    try:
        width, height = (int(part) for part in text.split('x'))
    except ValueError:
        raise argparse.ArgumentTypeError(f'{text} is no size such as 640x480') from None
    return width, height


def write_scenes(folder: Path) -> None:
    """Write the frames of the scenes, uncompressed, so that decoding costs little."""
    folder.mkdir()
    noise = np.random.default_rng(0)
    images: list[np.ndarray] = []
    for name in SCENES:
        images += [frame.image for frame in scene(name)]
        images += [noise.integers(0, 256, images[-1].shape, np.uint8) for _ in range(NOISE_FRAMES)]
    for number, image in enumerate(images):
        cv2.imwrite(str(folder / f'{number:06d}.bmp'), image)


def echo_masks(node: Node, every: int) -> None:
    """Publish one of so many masks as a heat map of its frame, which comes as late as the mask."""
    maps, places = node.create_publisher(Image, 'heat_map', 5), itertools.count()

    def heard(data: bytes) -> None:
        if next(places) % every == 0:
            maps.publish(data)

    node.create_subscription(Image, 'mask', heard, 5, raw=True)


def measure(style: str, size: tuple[int, int], options: argparse.Namespace) -> dict[str, Any]:
    """Measure one style at one size."""
    nodes, memory = STYLES[style], []
    with tempfile.TemporaryDirectory() as folder, session() as (processes, listener):
        film, box = Path(folder) / 'frames', None
        if options.people:
            write_scenes(film)
        else:
            box = write_clip(Path(folder), size, max(2, round(options.seconds * options.rate)))
        if options.heat_map:
            echo_masks(listener.node, max(1, round(options.rate / options.heat_map)))
        parameters = f'max_people:={options.people or 1}', *options.parameters
        start(processes, nodes, listener, *parameters, box=box)
        played = play(
            processes, nodes, film, options.rate, *(['--loop'] if options.people else [])
        )
        wait(lambda: bool(listener.arrived) or processes.ended('gait_source'), float('inf'))
        pids = [processes.pid(name) for name in nodes]
        began, used = time.monotonic(), sum(map(processor_seconds, pids))
        while not processes.ended('gait_source'):
            processes.check_running(*nodes)
            memory.append(sum(map(resident_mib, pids)))
            if options.people and time.monotonic() - began > options.seconds:
                processes.stop('gait_source')
            time.sleep(SAMPLE_S)
        passed = max(time.monotonic() - began, 1e-9)
        used = sum(map(processor_seconds, pids)) - used
        time.sleep(FLOW_OUT_S)
        published, arrived = sorted(read_stamps(played).values()), dict(listener.arrived)
    if not published or not arrived:
        raise ProcessError(f'{style}: {len(published)} frames published, none answered')
    latency = {t: 1e3 * (arrived[t] - t / 1e9) for t in published if t in arrived}
    missing = [t for t in published if t not in arrived]
    settled = published[0] + 1_000_000_000
    values = np.array(list(latency.values()))
    found = {f'p{share}': round(float(np.percentile(values, share)), 2) for share in (50, 95, 99)}
    late = [value for stamp, value in latency.items() if stamp >= settled]
    third = max(len(values) // 3, 1)
    first, last = (float(np.percentile(each, 95)) for each in (values[:third], values[-third:]))
    end = memory[-max(len(memory) // 3, 1) :]
    return found | {
        'max': round(float(values.max()), 2),
        'lost': sum(t >= settled for t in missing),
        'cpu_percent': round(100 * used / passed, 1),
        'rss_mib': round(memory[-1], 1),
        'drift': round((max(end) - min(end)) / max(end), 5),
        'slower': round(last / first, 3),
        'frames': len(published),
        'answered': len(latency),
        'lost_first_second': sum(t < settled for t in missing),
        'first': round(latency.get(published[0], float('inf')), 2),
        'max_after_first_second': round(max(late, default=0.0), 2),
        'ms': values.tolist(),
    }


def plot(lines: dict[str, tuple[list[float], int]], path: Path) -> None:
    """Draw the share of frames answered within a time, of the times in ms and all frames."""
    from matplotlib import pyplot as plt

    figure, axis = plt.subplots(figsize=(5.2, 3.2), layout='tight')
    for label, (times, frames) in lines.items():
        axis.step(sorted(times), 100 * np.arange(1, len(times) + 1) / frames, label=label)
    axis.set(xlabel='ms from stamp to mask', ylabel='% of frames', xlim=(0, None))
    axis.grid(alpha=0.3)
    axis.legend(fontsize=7, loc='lower right')
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
    add('-p', dest='parameters', nargs='+', default=[], metavar='NAME:=VALUE', help='of all nodes')
    add('--json', type=Path, metavar='FILE', help='write the figures here')
    add('--plot', type=Path, metavar='FILE', help='draw the distribution of the latency')
    add('--heat-map', type=float, default=0.0, metavar='HZ', help='publish heat maps as often')
    add('--people', type=int, default=0, metavar='N', help='play scenes for ever, N slots')
    options = parser.parse_args()
    report: Report = {}
    lines: dict[str, tuple[list[float], int]] = {}
    fine = True
    for size in options.sizes:
        name = f'{size[0]}x{size[1]}'
        report[name] = {}
        for style in options.styles:
            found = measure(style, size, options)
            report[name][style] = found
            lines[f'{style}, {name}'] = found.pop('ms'), found['frames']
            print(f'{name} {style:6s}', *(f'{k} {v}' for k, v in found.items()))
            bars = LONG if options.people else BARS.get((name, style), {})
            if options.parameters:
                bars = {}
            for key, limit in bars.items():
                fine &= holds(key, found[key], limit)
    if options.plot:
        plot(lines, options.plot)
    if options.json:
        first = report[next(iter(report))]
        options.json.write_text(json.dumps(first | report, indent=1) + '\n')
    return 0 if fine else 1


if __name__ == '__main__':
    sys.exit(run_tool('latency.py', main))
