#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Nodes killed with SIGKILL under a stream, and how long until frames are answered again.

gait_source plays a synthetic walker at 640 x 480 for ever; each node in turn is killed at a
moment drawn by lot (the seed is printed) and started again at once, as a launch file with
``respawn`` does.  The time goes from the kill to the first mask of a frame shown after it, and
includes the start of Python.  A node that gives none within 20 s counts as hung: its stacks are
printed (SIGUSR1), and it must end within 5 s of SIGTERM.  Needs ROS 2 and the kernels in Numba's
cache (gait_warm_up); leave the machine alone meanwhile::

    python benchmarks/restarts.py [--kills 50] [--nodes gait_tracker ...]

Fails if the worst time is above 3 s, anything hangs, another node ends, or a process is left.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.nodes import MODULES, Listener, write_clip
from gait_segmentation.cli.demo import prepare_environment
from gait_segmentation.cli.processes import ProcessError, ProcessGroup
from gait_segmentation.cli.tool import run_tool

SIZE, RATE, FRAMES = (640, 480), 30.0, 118
START_TIMEOUT_S, HUNG_S, TERM_S, POLL_S = 180.0, 20.0, 5.0, 0.005
STEADY_S = 0.5
"""Time for which frames are answered before the next kill, at least."""

BAR_S = 3.0
STACKS = 100
"""Lines of the stacks of all threads, about."""

MARK = 'GAIT_RESTARTS'
SEGMENTS = Path('/dev/shm')


@dataclass
class Outcome:
    """What became of a node that was killed some times."""

    times_s: list[float] = field(default_factory=list)
    hung: int = 0
    deaf: int = 0
    """Hung ones that SIGTERM did not end either."""


class Stage:
    """The nodes, the source and somebody who listens."""

    def __init__(self, processes: ProcessGroup, nodes: tuple[str, ...], frames: Path) -> None:
        """Start everything and wait until frames are answered."""
        self.processes = processes
        self.nodes = nodes
        for name in nodes:
            self.start(name)
        self.listener = Listener()
        processes.start(
            'gait_source', 'gait_segmentation.nodes.source_node', str(frames),
            '--rate', str(RATE), '--loop', '--preload',
        )  # fmt: skip
        if not self.wait(self.answered_after(time.time_ns()), START_TIMEOUT_S):
            raise ProcessError('no frame was answered')

    def start(self, name: str) -> None:
        """Start a node."""
        self.processes.start(name, 'gait_segmentation', name.removeprefix('gait_'))

    def answered_after(self, stamp_ns: int) -> Callable[[], bool]:
        """Return what tells whether a frame that was shown after a time has been answered."""
        return lambda: max(list(self.listener.arrived), default=0) > stamp_ns

    def wait(self, done: Callable[[], bool], timeout_s: float) -> bool:
        """Wait until something is so; return whether it is."""
        deadline = time.monotonic() + timeout_s
        while not done():
            if time.monotonic() > deadline:
                return False
            time.sleep(POLL_S)
        return True

    def kill(self, name: str, outcome: Outcome) -> None:
        """Kill a node, start it again and wait for its first answer."""
        # Older stamps are of no use any more.
        self.listener.arrived.clear()
        began_ns = time.time_ns()
        self.signal(name, signal.SIGKILL)
        self.start(name)
        if self.wait(self.answered_after(began_ns), HUNG_S):
            newest = min(stamp for stamp in list(self.listener.arrived) if stamp > began_ns)
            outcome.times_s.append(self.listener.arrived[newest] - began_ns / 1e9)
            return
        outcome.hung += 1
        self.examine(name, outcome)

    def signal(self, name: str, number: signal.Signals) -> bool:
        """Send a signal to a node if it runs; return whether one that is to end it does."""
        if self.processes.ended(name):
            return True
        os.kill(self.processes.pid(name), number)
        return number == signal.SIGUSR1 or self.wait(lambda: self.processes.ended(name), TERM_S)

    def examine(self, name: str, outcome: Outcome) -> None:
        """Print what a node that says nothing does, and end all nodes, which may wait for it."""
        for each in self.nodes:
            self.signal(each, signal.SIGUSR1)
            time.sleep(1.0)
            said = self.processes.last_lines(each, STACKS)
            print(f'--- {each} ({name} was killed)\n{said}', flush=True)
            if not self.signal(each, signal.SIGTERM):
                outcome.deaf += 1
                self.signal(each, signal.SIGKILL)
            self.start(each)
        self.wait(self.answered_after(time.time_ns()), START_TIMEOUT_S)


def left(mark: str) -> list[int]:
    """Return the processes that were started here and still run."""
    found = []
    for each in Path('/proc').iterdir():
        try:
            marked = f'{MARK}={mark}'.encode() in (each / 'environ').read_bytes().split(b'\0')
        except OSError:
            continue
        if marked and int(each.name) != os.getpid():
            found.append(int(each.name))
    return found


def segments_mib() -> float:
    """Return the size of what Fast DDS has in shared memory."""
    return sum(each.stat().st_size for each in SEGMENTS.glob('fastrtps_*')) / 2**20


def measure(nodes: tuple[str, ...], kills: int, seed: int) -> dict[str, Outcome]:
    """Kill each of some nodes that work together a number of times."""
    import rclpy
    from rclpy.signals import SignalHandlerOptions

    chance = random.Random(seed)
    outcomes = {name: Outcome() for name in nodes}
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    try:
        with (
            tempfile.TemporaryDirectory() as folder,
            ProcessGroup(os.environ, Path(folder)) as all_,
        ):
            write_clip(Path(folder), SIZE, FRAMES)
            stage = Stage(all_, nodes, Path(folder) / 'frames')
            try:
                for _ in range(kills):
                    for name in nodes:
                        time.sleep(STEADY_S + chance.random())
                        all_.check_running(*nodes, 'gait_source')
                        stage.kill(name, outcomes[name])
            finally:
                stage.listener.close()
    finally:
        rclpy.try_shutdown()
    return outcomes


def main() -> int:
    """Measure, print, and say whether what is promised holds."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = parser.add_argument
    add('--kills', type=int, default=50, metavar='N', help='of each node (%(default)s)')
    add('--seed', type=int, default=1)
    add('--styles', nargs='+', choices=('split', 'single'), default=['split', 'single'])
    options = parser.parse_args()
    prepare_environment(os.environ)
    # An installed package has it.
    os.environ.pop('PYTHONDONTWRITEBYTECODE', None)
    mark = os.environ[MARK] = str(os.getpid())
    print(f'seed {options.seed}, {segments_mib():.0f} MiB in shared memory before', flush=True)
    groups = {'split': tuple(MODULES)[:3], 'single': tuple(MODULES)[3:]}
    fine = True
    for style in options.styles:
        for name, found in measure(groups[style], options.kills, options.seed).items():
            times = found.times_s or [float('inf')]
            holds = max(times) <= BAR_S and not found.hung
            fine &= holds
            print(
                f'{"ok  " if holds else "MISS"} {name:14} {len(found.times_s):4} back, median '
                f'{statistics.median(times):5.2f} s, worst {max(times):5.2f} s (bar {BAR_S:g} s), '
                f'{found.hung} hung, {found.deaf} of them deaf to SIGTERM',
                flush=True,
            )
    orphans = left(mark)
    fine &= not orphans
    print(f'{"MISS" if orphans else "ok  "} {len(orphans)} processes left')
    print(f'     {segments_mib():.0f} MiB in shared memory after')
    return 0 if fine else 1


if __name__ == '__main__':
    sys.exit(run_tool('restarts.py', main))
