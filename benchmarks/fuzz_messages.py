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
import os
import re
import secrets
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from gait_segmentation.cli.demo import prepare_environment
from gait_segmentation.cli.tool import run_tool

if TYPE_CHECKING:
    from hostile.kinds import Aim, Call
    from hostile.nodes import Client, Graphs

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
        from hostile.kinds import KINDS

        self.sent: Counter[str] = Counter()
        self.failures: list[str] = []
        self._kinds = {name: KINDS[name] for name in names}
        self._aim, self._client, self._graphs = aim, client, graphs
        weights = [weight for _, weight in self._kinds.values()]
        self._chances = [weight / sum(weights) for weight in weights]
        self._todo: list[str] = []
        self._recent: list[str] = []
        self._ended: list[str] = []

    def run(self, messages: int, until_s: float) -> float:
        """Send messages and return how long it took, in seconds."""
        for _ in range(SETTLING):
            self._good_frame()
        self._graphs.begin()
        began = time.monotonic()
        # Every kind at least once.
        self._todo = list(self._aim.rng.permutation(list(self._kinds)))
        while self.sent.total() < messages and time.monotonic() < until_s:
            self._recent = self._recent[-BURST:]
            for name in self._burst():
                self._send(name)
            self._good_frame()
            self._graphs.watch()
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
        return str(self._aim.rng.choice(list(self._kinds), p=self._chances))

    def _send(self, name: str) -> None:
        from hostile.kinds import Shot

        self._recent.append(name)
        make, _ = self._kinds[name]
        paused = False
        for each in make(self._aim):
            self.sent[name] += 1
            if isinstance(each, Shot):
                self._client.fire(each)
            else:
                paused |= each.pauses
                self._call(each)
        if paused and not self._client.wait_until_connected(self._alive):
            self._fail('not connected again')

    def _call(self, call: Call) -> None:
        if not self._client.call(call, PATIENCE_S) and not self._alive():
            self._fail(f'{call.node}/{call.service} is not answered')

    def _good_frame(self) -> None:
        from hostile.kinds import GOOD

        aim = self._aim
        aim.advance()
        stamp_ns = self._client.show(camera_message(aim, GOOD, self._client.camera_topic))
        answered = self._client.wait_for(stamp_ns, self._alive, PATIENCE_S)
        if not answered and not self._ended:
            missing = self._client.missing(stamp_ns)
            self._fail(f'good frame {aim.number} is not answered on {", ".join(missing)}')
        while self._ended or self._alive():
            self._ended.clear()
            self._client.wait_until_connected(self._alive)

    def _alive(self) -> bool:
        """Start what has ended again; return whether anything has."""
        ended = self._graphs.revive()
        for name in ended:
            self._fail(f'{name} ended\n{self._graphs.last_lines(name)}')
        self._ended += ended
        return bool(ended)

    def _fail(self, what: str) -> None:
        self.failures.append(what)
        print(f'MISS {what}\n     after {"; ".join(self._recent)}', flush=True)


def camera_message(aim: Aim, frame_id: str, topic: str) -> Any:
    """Return the next frame of the film as the camera publishes it."""
    from hostile.compressed import compressed, encode
    from hostile.kinds import header

    from gait_segmentation.ros.image import image_message

    about = header(aim.stamp_ns, frame_id)
    if topic == 'image':
        return image_message(aim.image, about)
    return compressed(about, encode(aim.image, '.jpg'))


def kinds_for(transport: str, only: str) -> list[str]:
    """Return the names of the kinds that go to nodes with a transport."""
    import hostile.compressed
    import hostile.images
    import hostile.parts
    import hostile.services  # noqa: F401
    from hostile.kinds import KINDS

    packed = transport == 'compressed'
    return [
        name for name in KINDS if name.startswith('compressed') == packed and re.search(only, name)
    ]


def run(transport: str, options: argparse.Namespace, logs: Path, until_s: float) -> bool:
    """Send messages to nodes with a transport, print what came of it, say whether all holds."""
    import numpy as np
    from hostile.kinds import Aim
    from hostile.nodes import Client, Graphs

    from benchmarks.synthetic import SyntheticConfig, SyntheticSequence

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
        seconds = fuzz.run(round(options.messages * SHARES[transport]), until_s)
        return report(transport, fuzz, client, graphs, seconds, options.messages)
    finally:
        client.close()
        graphs.close()


def report(
    transport: str, fuzz: Fuzz, client: Client, graphs: Graphs, seconds: float, messages: int
) -> bool:
    """Print what came of it and say whether all holds."""
    for name, count in sorted(fuzz.sent.items()):
        print(f'{count:7}  {name}')
    lost, twice, shown = client.account()
    growth = graphs.growth()
    lines = graphs.lines()
    wanted = round(messages * SHARES[transport])
    sent = f'{fuzz.sent.total()} messages of {len(fuzz.sent)} kinds in {seconds:.0f} s'
    late = f', but the time was up before {wanted}' if fuzz.sent.total() < wanted else ''
    print(f'{transport}: {sent}{late}')
    for name in lines:
        now, peak = growth.get(name, (float('nan'),) * 2)
        print(
            f'  {name:15} {graphs.exits[name]} exits, {lines[name][0] / seconds:.2f} lines/s '
            f'({lines[name][1]} more of libraries), '
            f'RSS {now:+.1f} MiB, at most {peak:+.1f}; {client.counts(name)}'
        )
    per_second = sum(own for own, _ in lines.values()) / seconds
    most = max((peak for _, peak in growth.values()), default=0.0)
    checks = {
        f'{graphs.exits.total()} exits': not graphs.exits,
        f'{len(fuzz.failures)} failures': not fuzz.failures,
        f'{max(lost.values(), default=0)} of {shown} frames lost {dict(lost) or ""}': not lost,
        f'{max(twice.values(), default=0)} answered twice {dict(twice) or ""}': not twice,
        f'{per_second:.2f} < {LINES_PER_SECOND:g} lines a second': per_second < LINES_PER_SECOND,
        f'RSS {most:+.1f} <= {GROWTH_MIB:+g} MiB': most <= GROWTH_MIB,
    }  # fmt: skip
    for text, holds in checks.items():
        print(f'{"ok  " if holds else "MISS"} {transport}: {text}', flush=True)
    return all(checks.values())


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
    prepare_environment(os.environ)
    if options.list:
        print(*(name for transport in SHARES for name in kinds_for(transport, '')), sep='\n')
        return 0
    print(f'seed {options.seed}', flush=True)
    # Here, so that it finds the environment prepared.
    import rclpy
    from rclpy.signals import SignalHandlerOptions

    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    fine = True
    begun = time.monotonic()
    share = 0.0
    try:
        with tempfile.TemporaryDirectory() as scratch:
            for transport in SHARES:
                share += SHARES[transport]
                logs = (options.logs or Path(scratch)) / transport
                fine &= run(transport, options, logs, begun + 60 * share * options.minutes)
    finally:
        rclpy.try_shutdown()
    return 0 if fine else 1


if __name__ == '__main__':
    sys.exit(run_tool('fuzz_messages.py', main))
