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
import sys
import tempfile
import time
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.bars import holds
from benchmarks.nodes import FLOW_OUT_S, STYLES, play, resident_mib, session, start
from benchmarks.synthetic.scenes import scene
from gait_segmentation.cli.processes import ProcessError
from gait_segmentation.cli.tool import run_tool

SCENES = ('exit-enter', 'crossing', 'exit-return')
NOISE_FRAMES = 30
SAMPLE_S = 5.0
SECOND_NS, MINUTE_NS = 1_000_000_000, 60_000_000_000
FLAT, SLOWER = 0.01, 1.2


def write_film(folder: Path) -> None:
    """Write the frames of the scenes, uncompressed, so that decoding costs little."""
    folder.mkdir()
    noise = np.random.default_rng(0)
    number = 0
    for name in SCENES:
        images = [frame.image for frame in scene(name)]
        shape = images[0].shape
        images += [noise.integers(0, 256, shape).astype(np.uint8) for _ in range(NOISE_FRAMES)]
        for image in images:
            cv2.imwrite(str(folder / f'{number:06d}.bmp'), image)
            number += 1


def soak(film: Path, options: argparse.Namespace) -> bool:
    """Play the film for some minutes, print what came of it, say whether it is as promised."""
    nodes = STYLES['split' if options.split else 'single']
    memory: list[tuple[int, float]] = []
    with session() as (processes, listener, _):
        start(processes, nodes, listener, f'max_people:={options.people}')
        stamps = play(processes, nodes, film, options.rate, '--loop')
        end = None
        while end is None or time.monotonic() < end:
            processes.check_running(*nodes, 'gait_source')
            if listener.arrived:
                used = sum(resident_mib(processes.pid(name)) for name in nodes)
                memory.append((time.time_ns(), used))
                end = end or time.monotonic() + 60 * options.minutes
            time.sleep(SAMPLE_S if end else SAMPLE_S / 10)
        processes.stop('gait_source')
        time.sleep(FLOW_OUT_S)
        shown = [int(line.split()[1]) for line in stamps.read_text().splitlines()]
        fine = judge(shown, dict(listener.arrived), memory)
        if not fine:
            print('\n'.join(f'{name}:\n{processes.last_lines(name)}' for name in nodes))
        return fine


def judge(shown: list[int], arrived: dict[int, float], memory: list[tuple[int, float]]) -> bool:
    """Print a table, and what is promised; return whether that holds."""
    counted = [each for each in shown if each >= shown[0] + SECOND_NS]
    lost = [each for each in counted if each not in arrived]
    high = []
    print('minute  frames  lost   p50   p95    max      rss')
    for minute in range(max(round((counted[-1] - shown[0]) / MINUTE_NS + 0.4), 1)):
        within = range(begin := shown[0] + minute * MINUTE_NS, begin + MINUTE_NS)
        frames = [each for each in counted if each in within]
        late = [1e3 * (arrived[t] - t / 1e9) for t in frames if t in arrived]
        if not late:
            raise ProcessError(f'no frame of minute {minute} was answered')
        median, p95, most = np.percentile(late, (50, 95, 100))
        high.append(float(p95))
        used = max((each for at, each in memory if at in within), default=float('nan'))
        print(
            f'{minute:6} {len(frames):7} {len(frames) - len(late):5} {median:5.1f} {p95:5.1f} '
            f'{most:6.1f} {used:8.1f}'
        )
    last = [used for _, used in memory][-max(1, len(memory) // 3) :]
    change = (max(last) - min(last)) / max(last)
    checks = (
        holds('frames lost', len(lost), 0),
        holds('change of memory in the last third', change, FLAT),
        holds('p95 of the last minute over that of the first', high[-1] / high[0], SLOWER),
    )
    return all(checks)


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
    with tempfile.TemporaryDirectory() as folder:
        film = Path(folder) / 'frames'
        write_film(film)
        return 0 if soak(film, options) else 1


if __name__ == '__main__':
    sys.exit(run_tool('soak.py', main))
