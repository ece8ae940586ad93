#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The nodes for long: frames lost, memory and latency, minute by minute.

gait_source plays, for ever, synthetic scenes of 640 x 480 with sensor noise in which people come,
cross, go and come back, and between them a second of nothing but noise; gait_pipeline, or the
three nodes with ``--split``, answer over DDS.  Needs ROS 2 and the kernels in Numba's cache
(gait_warm_up); leave the machine alone meanwhile::

    python benchmarks/soak.py [--minutes 30] [--split] [--people 1]

Latencies are from the stamp to the mask in ms, ``rss`` is of all nodes together in MiB, the
largest of the minute.  Fails if a frame published after the first second has no mask, if the
memory of the last third changes by more than 1 %, or if the 95th percentile of the last minute
is more than 20 % above that of the first.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.latency import FLOW_OUT_S, STYLES, Listener, resident_mib, start
from gait_segmentation.cli.demo import prepare_environment
from gait_segmentation.cli.processes import ProcessError, ProcessGroup
from gait_segmentation.cli.tool import run_tool

SCENES = ('exit-enter', 'crossing', 'exit-return')
NOISE_FRAMES = 30
SETTLED_NS = 1_000_000_000
SAMPLE_S = 5.0
FLAT, SLOWER = 0.01, 1.2


@dataclass
class Run:
    """What was seen: stamps in ns, arrivals in s by stamp, memory by time in s, ends of logs."""

    stamps: list[int]
    arrived: dict[int, float]
    memory: list[tuple[float, float]]
    said: str


def write_film(folder: Path) -> None:
    """Write the frames of the scenes, uncompressed, so that decoding costs little."""
    import cv2
    import numpy as np

    from benchmarks.synthetic.scenes import scene

    noise = np.random.default_rng(0)
    number = 0
    for name in SCENES:
        images = [frame.image for frame in scene(name)]
        shape = images[0].shape
        images += [noise.integers(0, 256, shape).astype(np.uint8) for _ in range(NOISE_FRAMES)]
        for image in images:
            cv2.imwrite(str(folder / f'{number:06d}.bmp'), image)
            number += 1


def run(style: str, film: Path, minutes: float, rate: float, people: int) -> Run:
    """Play the film for some minutes."""
    import rclpy
    from rclpy.signals import SignalHandlerOptions

    nodes = STYLES[style]
    memory: list[tuple[float, float]] = []
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    try:
        with (
            tempfile.TemporaryDirectory() as logs,
            ProcessGroup(os.environ, Path(logs)) as processes,
        ):
            listener = Listener()
            try:
                start(processes, nodes, listener, f'max_people:={people}')
                stamps = Path(logs) / 'stamps.txt'
                processes.start(
                    'gait_source', 'gait_segmentation.nodes.source_node', str(film), '--loop',
                    '--rate', str(rate), '--wait-for', str(min(len(nodes), 2)),
                    '--delay', '1', '--stamps', str(stamps),
                )  # fmt: skip
                while not listener.arrived:
                    processes.check_running(*nodes, 'gait_source')
                    time.sleep(SAMPLE_S / 10)
                end = time.time() + 60 * minutes
                while time.time() < end:
                    processes.check_running(*nodes, 'gait_source')
                    used = sum(resident_mib(processes.pid(name)) for name in nodes)
                    memory.append((time.time(), used))
                    time.sleep(SAMPLE_S)
                processes.stop('gait_source')
                time.sleep(FLOW_OUT_S)
                said = '\n'.join(f'{name}:\n{processes.last_lines(name)}' for name in nodes)
            finally:
                listener.close()
            lines = stamps.read_text().splitlines()
            shown = [int(line.split()[1]) for line in lines]
            return Run(shown, dict(listener.arrived), memory, said)
    finally:
        rclpy.try_shutdown()


def judge(found: Run) -> bool:
    """Print a table, and what is promised; return whether that holds."""
    import numpy as np

    first_ns = found.stamps[0]
    counted = [each for each in found.stamps if each >= first_ns + SETTLED_NS]
    lost = [each for each in counted if each not in found.arrived]
    minutes = round((counted[-1] - first_ns) / 60e9 + 0.4)
    high = []
    print('minute  frames  lost   p50   p95    max      rss')
    for minute in range(max(minutes, 1)):
        begin = first_ns + minute * 60_000_000_000
        within = [each for each in counted if begin <= each < begin + 60_000_000_000]
        late = [1e3 * (found.arrived[t] - t / 1e9) for t in within if t in found.arrived]
        if not late:
            raise ProcessError(f'no frame of minute {minute} was answered')
        used = [each for at, each in found.memory if begin <= 1e9 * at < begin + 60_000_000_000]
        median, p95, most = np.percentile(late, (50, 95, 100))
        high.append(float(p95))
        missing = sum(begin <= each < begin + 60_000_000_000 for each in lost)
        print(
            f'{minute:6} {len(within):7} {missing:5} {median:5.1f} {p95:5.1f} {most:6.1f} '
            f'{max(used, default=float("nan")):8.1f}'
        )
    last = [used for _, used in found.memory][-max(1, len(found.memory) // 3) :]
    change = (max(last) - min(last)) / max(last)
    fine = True
    for name, value, bar in (
        ('frames lost', len(lost), 0),
        ('change of memory in the last third', change, FLAT),
        ('p95 of the last minute over that of the first', high[-1] / high[0], SLOWER),
    ):
        fine &= value <= bar
        print(f'{"ok  " if value <= bar else "MISS"} {name}: {value:.4g} <= {bar:g}')
    if not fine:
        print(found.said)
    return fine


def main() -> int:
    """Measure, print, and say whether what is promised holds."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = parser.add_argument
    add('--minutes', type=float, default=30.0)
    add('--split', action='store_true', help='the three nodes instead of gait_pipeline')
    add('--rate', type=float, default=30.0, metavar='HZ')
    add('--people', type=int, default=1, metavar='N', help='slots (%(default)s)')
    options = parser.parse_args()
    prepare_environment(os.environ)
    with tempfile.TemporaryDirectory() as film:
        write_film(Path(film))
        style = 'split' if options.split else 'single'
        found = run(style, Path(film), options.minutes, options.rate, options.people)
    return 0 if judge(found) else 1


if __name__ == '__main__':
    sys.exit(run_tool('soak.py', main))
