#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Hostile messages to the four nodes, with good frames between.

gait_tracker, gait_matcher and gait_segmenter in one namespace and gait_pipeline in another run as
processes with their defaults; one client sends them messages of all kinds in ``hostile/``, shows a
good frame after every few, and waits for the answers to it.  First images are raw, then
compressed.  What must hold: no node ends or hangs, tracker and pipeline answer every good frame
once on each topic, the nodes together log less than 5 lines a second, and none grows by more than
50 MiB.  What libraries print by themselves is counted apart: Fast DDS of bytes that are no
message, libpng and libjpeg of spoilt images.  Needs ROS 2::

    python benchmarks/fuzz_messages.py [--messages 20000] [--seed 1] [--minutes 20]
        [--only REGEX] [--logs FOLDER] [--list]

The seed gives the same messages again, though not the same times.  A node that ends is started
again, and what was sent before is printed.  Exit code 0: all holds; 1: something does not.
"""

from __future__ import annotations

import argparse
import re
import secrets
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import hostile.compressed
import hostile.messages
import hostile.services  # noqa: F401
from hostile.compressed import compressed, encode
from hostile.kinds import GOOD, KINDS, Aim, Shot, header
from hostile.nodes import Client, Graphs

from benchmarks.bars import holds
from benchmarks.nodes import ros
from benchmarks.synthetic import SyntheticConfig, SyntheticSequence
from gait_segmentation.cli.tool import run_tool
from gait_segmentation.ros.messages import image_message

SHARES = {'raw': 0.8, 'compressed': 0.2}
BURST = 4
"""Kinds of hostile messages between two good frames, at most: fewer images than may wait."""

SETS = ('matcher', 'segmenter', 'feedback')
"""How the names of the kinds begin that send all that a node joins."""

MASKS_S = 0.5
SETTLING = 60
PATIENCE_S = 60.0
LINES_PER_SECOND, GROWTH_MIB = 5.0, 50.0
SIZE = (240, 180)
"""Small enough for the stages to work on whole images, so that likelihoods have their size."""


class Fuzz:
    """One run against nodes of one transport."""

    def __init__(self, aim: Aim, names: Sequence[str], client: Client, graphs: Graphs) -> None:
        """
        Begin with connected nodes.

        :param names: the kinds of messages to send.
        """
        self.sent: Counter[str] = Counter()
        self.failures: list[str] = []
        self._names = list(names)
        self._aim, self._client, self._graphs = aim, client, graphs
        weights = np.array([KINDS[name][1] for name in names])
        self._chances = weights / weights.sum()
        # Every kind at least once.
        self._todo = list(aim.rng.permutation(self._names))
        self._recent: list[str] = []
        self._ended: list[str] = []

    def run(self, messages: int, until_s: float) -> float:
        """Send messages and return how long it took, in seconds."""
        for _ in range(SETTLING):
            self._good_frame()
        self._graphs.begin()
        began = time.monotonic()
        while self.sent.total() < messages and time.monotonic() < until_s:
            self._recent = self._recent[-BURST:]
            for name in self._burst():
                self._send(name)
            self._good_frame()
            for name, more in self._graphs.watch().items():
                if more > GROWTH_MIB / 5:
                    print(f'     {name} {more:+.0f} MiB after {"; ".join(self._recent)}')
        return time.monotonic() - began

    def _burst(self) -> list[str]:
        """Return the kinds to send before the next good frame."""
        names = [self._next() for _ in range(int(self._aim.rng.integers(1, BURST + 1)))]
        sets = [name for name in names if name.startswith(SETS)]
        self._todo += sets[1:]
        if sets:
            # Else what the nodes make of the frames before comes in the middle of the set, with
            # stamps that go back, and nothing is joined.
            self._client.wait_for_masks(MASKS_S)
        return sets[:1] + [name for name in names if name not in sets]

    def _next(self) -> str:
        if self._todo:
            return self._todo.pop()
        return str(self._aim.rng.choice(self._names, p=self._chances))

    def _send(self, name: str) -> None:
        self._recent.append(name)
        paused = False
        for each in KINDS[name][0](self._aim):
            self.sent[name] += 1
            if isinstance(each, Shot):
                self._client.fire(each)
            else:
                paused |= each.pauses
                if not self._client.call(each, PATIENCE_S) and not self._revived():
                    self._fail(f'{each.node}/{each.service} is not answered')
        if paused and not self._client.wait_until_connected(self._revived):
            self._fail('not connected again')

    def _good_frame(self) -> None:
        self._aim.advance()
        stamp_ns = self._client.show(camera_message(self._aim, self._client.camera_topic))
        answered = self._client.wait_for(stamp_ns, self._revived, PATIENCE_S)
        if not answered and not self._ended:
            missing = self._client.missing(stamp_ns)
            self._fail(f'good frame {self._aim.number} is not answered on {", ".join(missing)}')
        while self._ended or self._revived():
            self._ended.clear()
            self._client.wait_until_connected(self._revived)

    def _revived(self) -> bool:
        """Start what has ended again; return whether anything has."""
        ended = self._graphs.revive()
        for name in ended:
            self._fail(f'{name} ended\n{self._graphs.last_lines(name)}')
        self._ended += ended
        return bool(ended)

    def _fail(self, what: str) -> None:
        self.failures.append(what)
        print(f'MISS {what}\n     after {"; ".join(self._recent)}', flush=True)


def camera_message(aim: Aim, topic: str) -> Any:
    """Return the next frame of the film as the camera publishes it."""
    about = header(aim.stamp_ns, GOOD)
    if topic == 'image':
        return image_message(aim.image, about)
    return compressed(about, encode(aim.image, '.jpg'))


def kinds_for(transport: str, only: str) -> list[str]:
    """Return the names of the kinds that go to nodes with a transport."""
    packed = transport == 'compressed'
    return [
        name for name in KINDS if name.startswith('compressed') == packed and re.search(only, name)
    ]


def run(transport: str, options: argparse.Namespace, logs: Path, until_s: float) -> bool:
    """Send messages to nodes with a transport, print what came of it, say whether all holds."""
    names = kinds_for(transport, options.only)
    if not names:
        return True
    film = SyntheticSequence(
        SyntheticConfig(seed=3, width=SIZE[0], height=SIZE[1], frames=30, person_height=120.0)
    )
    assert film.initial_box is not None
    rng = np.random.default_rng([options.seed, len(names)])
    graphs = Graphs(logs, transport, film.initial_box)
    client = Client(transport)
    try:
        if not client.wait_until_connected(graphs.revive):
            print(f'MISS the nodes do not start: see {logs}')
            return False
        fuzz = Fuzz(Aim(rng, [frame.image for frame in film]), names, client, graphs)
        wanted = round(options.messages * SHARES[transport])
        return report(transport, fuzz, client, graphs, fuzz.run(wanted, until_s))
    finally:
        client.close()
        graphs.close()


def report(transport: str, fuzz: Fuzz, client: Client, graphs: Graphs, seconds: float) -> bool:
    """Print what came of it and say whether all holds."""
    for name, count in sorted(fuzz.sent.items()):
        print(f'{count:7}  {name}')
    lost, twice, shown = client.account()
    growth, lines = graphs.growth(), graphs.lines()
    kinds = len(fuzz.sent)
    print(f'{transport}: {fuzz.sent.total()} messages of {kinds} kinds in {seconds:.0f} s')
    for name, (own, others) in lines.items():
        now, peak = growth[name]
        print(
            f'  {name:15} {graphs.exits[name]} exits, {own / seconds:.2f} lines/s '
            f'({others} more of libraries), RSS {now:+.1f} MiB, at most {peak:+.1f}; '
            f'{client.counts(name)}'
        )
    per_second = sum(own for own, _ in lines.values()) / seconds
    most = max(peak for _, peak in growth.values())
    checks = [
        holds(f'{transport}: exits', graphs.exits.total(), 0),
        holds(f'{transport}: failures', len(fuzz.failures), 0),
        holds(f'{transport}: of {shown} frames lost', max(lost.values(), default=0), 0),
        holds(f'{transport}: of them answered twice', max(twice.values(), default=0), 0),
        holds(f'{transport}: lines a second', per_second, LINES_PER_SECOND),
        holds(f'{transport}: growth in MiB', most, GROWTH_MIB),
    ]
    return all(checks)


def main() -> int:
    """Send, measure, print, and say whether what is promised holds."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = parser.add_argument
    add('--messages', type=int, default=20_000, metavar='N')
    add('--seed', type=int, default=secrets.randbelow(1 << 32), metavar='S', help='random')
    add('--minutes', type=float, default=20.0, metavar='M', help='at most (%(default)s)')
    add('--only', default='', metavar='REGEX', help='kinds whose name this is found in')
    add('--logs', type=Path, metavar='FOLDER', help='keep what the nodes log')
    add('--list', action='store_true', help='list the kinds and end')
    options = parser.parse_args()
    if options.list:
        print(*(name for transport in SHARES for name in kinds_for(transport, '')), sep='\n')
        return 0
    print(f'seed {options.seed}', flush=True)
    fine = True
    end = time.monotonic()
    with ros(), tempfile.TemporaryDirectory() as scratch:
        for transport, share in SHARES.items():
            end += 60 * share * options.minutes
            fine &= run(transport, options, (options.logs or Path(scratch)) / transport, end)
    return 0 if fine else 1


if __name__ == '__main__':
    sys.exit(run_tool('fuzz_messages.py', main))
