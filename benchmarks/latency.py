# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Latency from a frame's stamp to its mask, over DDS, as a user of the topics sees it.

The demonstration's film is played as a live camera at several widths, into the three nodes
(split) and into gait_pipeline (single).  Needs ROS 2 and, the first time, a network:

    python benchmarks/latency.py --widths 640 960 --rate 30
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from pathlib import Path

from gait_segmentation.cli.clip import CLIP_BOX, CLIP_START, demo_clip
from gait_segmentation.cli.demo import (
    NODES,
    frames_shown,
    play,
    prepare_environment,
    read_stamps,
    start_nodes,
)
from gait_segmentation.cli.film import Film
from gait_segmentation.cli.processes import ProcessGroup

FRAMES = 130
"""Frames played: the person is in view in all of them."""

COLUMNS = ('nodes', 'size', 'in', 'out', 'ms p50', 'ms p95', 'ms max', 'ms p95 after 1 s')


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--widths', type=int, nargs='+', default=[640, 960])
    parser.add_argument('--styles', nargs='+', choices=['split', 'single'])
    parser.add_argument('--rate', type=float, default=30.0, metavar='HZ')
    options = parser.parse_args()
    path = demo_clip()
    prepare_environment(os.environ)
    print('| ' + ' | '.join(COLUMNS) + ' |\n|' + '---|' * len(COLUMNS))
    for width in options.widths:
        film = Film(path, width=width, start=CLIP_START, count=FRAMES)
        for style in options.styles or ['split', 'single']:
            print(measure(film, style, options.rate), flush=True)
    return 0


def measure(film: Film, style: str, rate: float) -> str:
    """Play the film once and return a row of the table."""
    # Here, so that rclpy finds the environment prepared.
    import numpy as np
    import rclpy
    from rclpy.signals import SignalHandlerOptions

    from gait_segmentation.cli.recorder import Recorder

    box = CLIP_BOX.scaled(film.scale)
    nodes = NODES if style == 'split' else ('gait_pipeline',)
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    try:
        with tempfile.TemporaryDirectory() as folder:
            logs = Path(folder)
            stamps = logs / 'stamps.txt'
            with ProcessGroup(os.environ, logs) as processes:
                if style == 'split':
                    start_nodes(processes, box)
                else:
                    numbers = f'[{box.x:.2f}, {box.y:.2f}, {box.width:.2f}, {box.height:.2f}]'
                    processes.start(
                        'gait_pipeline',
                        'gait_segmentation.nodes.pipeline_node',
                        *('--ros-args', '-p', f'initial_box:={numbers}'),
                    )
                recorder = Recorder()
                try:
                    play(processes, recorder, film, rate, stamps, nodes)
                finally:
                    recorder.close()
            published = read_stamps(stamps)
    finally:
        rclpy.try_shutdown()
    frames = frames_shown(published, recorder)
    latency = np.array([1e3 * shown.record.latency_s for shown in frames])
    late = latency[[shown.time_s > 1.0 for shown in frames]]
    median, high = np.percentile(latency, (50, 95))
    size = f'{film.size[0]} x {film.size[1]}'
    return (
        f'| {style} | {size} | {len(published)} | {len(frames)} | {median:.0f} | {high:.0f} | '
        f'{latency.max():.0f} | {np.percentile(late, 95):.0f} |'
    )


if __name__ == '__main__':
    sys.exit(main())
