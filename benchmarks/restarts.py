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

    python benchmarks/restarts.py [--kills 50] [--styles split ...]

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
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.bars import holds
from benchmarks.nodes import STYLES, Answers, session, start_node, wait, write_clip
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


@dataclass
class Outcome:
    """What became of a node that was killed some times."""

    times_s: list[float] = field(default_factory=list)
    hung: int = 0
    deaf: int = 0
    """Hung ones that SIGTERM did not end either."""


class Stage:
    """The nodes, the source and somebody who listens."""

    def __init__(
        self, processes: ProcessGroup, listener: Answers, nodes: tuple[str, ...], frames: Path
    ) -> None:
        """Start everything and wait until frames are answered."""
        self.processes, self.listener, self.nodes = processes, listener, nodes
        for name in nodes:
            start_node(processes, name)
        processes.start(
            'gait_source', 'gait_segmentation', 'source', str(frames),
            '--rate', str(RATE), '--loop', '--preload',
        )  # fmt: skip
        if not self.answers_after(time.time_ns(), START_TIMEOUT_S):
            raise ProcessError('no frame was answered')

    def answers_after(self, stamp_ns: int, timeout_s: float) -> bool:
        """Wait until a frame that was shown after a time is answered; return whether it is."""
        arrived = self.listener.arrived
        return wait(lambda: max(list(arrived), default=0) > stamp_ns, timeout_s, POLL_S)

    def kill(self, name: str, outcome: Outcome) -> None:
        """Kill a node, start it again and wait for its first answer."""
        # Older stamps are of no use any more.
        self.listener.arrived.clear()
        began_ns = time.time_ns()
        self.signal(name, signal.SIGKILL)
        start_node(self.processes, name)
        if self.answers_after(began_ns, HUNG_S):
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
        ended = partial(self.processes.ended, name)
        return number == signal.SIGUSR1 or wait(ended, TERM_S, POLL_S)

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
            start_node(self.processes, each)
        self.answers_after(time.time_ns(), START_TIMEOUT_S)


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


def measure(nodes: tuple[str, ...], kills: int, seed: int) -> dict[str, Outcome]:
    """Kill each of some nodes that work together a number of times."""
    chance = random.Random(seed)
    outcomes = {name: Outcome() for name in nodes}
    with tempfile.TemporaryDirectory() as folder, session() as (processes, listener):
        write_clip(Path(folder), SIZE, FRAMES)
        stage = Stage(processes, listener, nodes, Path(folder) / 'frames')
        for _ in range(kills):
            for name in nodes:
                time.sleep(STEADY_S + chance.random())
                processes.check_running(*nodes, 'gait_source')
                stage.kill(name, outcomes[name])
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
    # An installed package has it.
    os.environ.pop('PYTHONDONTWRITEBYTECODE', None)
    mark = os.environ[MARK] = str(os.getpid())
    print(f'seed {options.seed}', flush=True)
    fine = True
    for style in options.styles:
        for name, found in measure(STYLES[style], options.kills, options.seed).items():
            times = found.times_s or [float('inf')]
            about = f'(median {statistics.median(times):.2f}, {len(found.times_s)} back)'
            fine &= holds(f'{name}, worst time in s', max(times), BAR_S, more=about)
            deaf = f'({found.deaf} deaf to SIGTERM)'
            fine &= holds(f'{name}, hung', found.hung, 0, more=deaf)
    fine &= holds('processes left', len(left(mark)), 0)
    return 0 if fine else 1


if __name__ == '__main__':
    sys.exit(run_tool('restarts.py', main))
