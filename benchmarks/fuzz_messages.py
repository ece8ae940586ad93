#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Hostile messages to five nodes, with good frames between.

gait_tracker, gait_matcher, gait_segmenter and gait_localizer in one namespace, and gait_pipeline
in another run as processes with their defaults; one client sends them messages and requests as
``spoilt_messages.py`` spoils them, shows a good frame after every few, and waits for the answers
to it.  First images are raw, then compressed.  What must hold: no node ends or hangs, tracker and
pipeline answer every good frame once on each topic, the nodes together log less than
5 lines a second, and none grows by more than 50 MiB.  What libraries print by themselves does not
count: Fast DDS of bytes that are no message, libpng and libjpeg of spoilt images.  Needs ROS 2::

    python benchmarks/fuzz_messages.py [--messages 20000] [--seed 1] [--minutes 20]
        [--logs FOLDER]

The seed gives the same messages again, though not the same times.  A node that ends is started
again, and what was sent before is printed.  Exit code 0: all holds; 1: something does not.
"""

from __future__ import annotations

import re
import sys
import tempfile
import threading
import time
from collections import Counter
from pathlib import Path
from random import Random

from rclpy.qos import QoSProfile
from sensor_msgs.msg import Image

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks import holds
from benchmarks.fuzzing import fuzz_parser
from benchmarks.running_nodes import resident_mib, wait
from benchmarks.spoilt_messages import (
    KINDS,
    NODES,
    SERVICES,
    SETS,
    SPACES,
    Call,
    Shot,
    calls,
    good,
    header,
    shots,
)
from benchmarks.synthetic import SyntheticConfig, SyntheticSequence
from gait_segmentation.cli.tool import run_tool
from gait_segmentation.ros.endpoints import LATCHED
from gait_tools.demo.nodes import Listener, ProcessGroup, ros

SHARES = {'image': 0.8, 'image/compressed': 0.2}
"""How many of the messages go to nodes with a topic of the camera."""

BURST = 3
"""Sets between two good frames, at most: fewer images than may wait."""

STEP_NS, APART_NS = 33_333_337, 50_000
"""From one good frame to the next, and from one spoilt set between to the next."""

MASKS_S, REFUSED_S, PATIENCE_S, START_S = 0.5, 0.1, 60.0, 900.0
SETTLING = 60
LINES_PER_SECOND, GROWTH_MIB = 5.0, 50.0
SIZE = (240, 180)
"""Small enough for the stages to work on whole images, so that likelihoods have their size."""

GOOD = 'good'
"""The frame_id of frames that must be answered."""

_PERSON = {name: kind for name, kind in KINDS.items() if name.startswith('person_0/')}
ANSWERS = {
    **{f'split/{name}': _PERSON[name] for name in ('person_0/box', 'person_0/likelihood')},
    **{f'single/{name}': kind for name, kind in _PERSON.items()},
    **dict.fromkeys(('single/mask', 'single/labels'), Image),
}
"""On which every good frame is to be answered once: by tracker and pipeline."""

_TWO_READERS = ('image', 'image/compressed', 'person_0/likelihood', 'person_0/matched_box',
                'person_0/shape_prior')  # fmt: skip
_LOGGED = re.compile(rb'^\[(?:DEBUG|INFO|WARN|ERROR|FATAL)\] \[', re.MULTILINE)


class Nodes(ProcessGroup):
    """The processes of the nodes, started again when they end, in their namespaces."""

    def __init__(self, logs: Path, *parameters: str) -> None:
        """Start all, with parameters as ``name:=value``."""
        self.exits: Counter[str] = Counter()
        self.peak: Counter[str] = Counter()
        """Most memory in MiB."""

        super().__init__(logs)
        self._parameters = parameters
        self._runs: dict[str, list[str]] = {name: [] for name in NODES}
        for name in NODES:
            self._begin(name)

    def revive(self) -> list[str]:
        """Start again what has ended; return the names, with what each said last."""
        said = []
        for name, runs in self._runs.items():
            if self.ended(runs[-1]):
                said.append(f'{name} ended\n{self.last_lines(runs[-1])}')
                self.exits[name] += 1
                self._begin(name)
        return said

    def look(self) -> dict[str, float]:
        """Return the memory that each has now, in MiB."""
        now = {n: resident_mib(self.pid(runs[-1])) for n, runs in self._runs.items()}
        self.peak |= Counter(now)
        return now

    def lines(self) -> Counter[str]:
        """Return how many lines each node has logged."""
        return Counter({
            name: sum(len(_LOGGED.findall((self._logs / f'{r}.log').read_bytes())) for r in runs)
            for name, runs in self._runs.items()
        })  # fmt: skip

    def _begin(self, name: str) -> None:
        runs = self._runs[name]
        runs.append(f'{name}_{len(runs)}')
        space = next(space for space, names in SPACES.items() if name in names)
        given = [word for each in self._parameters for word in ('-p', each)]
        module = f'gait_segmentation.nodes.{name.removeprefix("gait_")}_node'
        command = module, '--ros-args', '-r', f'__ns:=/{space}', *given
        self.start(runs[-1], *command)


class Client(Listener):
    """Publishes to all nodes and counts the answers to good frames."""

    def __init__(self, camera: str) -> None:
        """Make all endpoints but for the other topic of a camera; rclpy must be initialised."""
        self.answers: dict[int, Counter[str]] = {}
        super().__init__(ANSWERS | {'split/mask': Image})
        read = {
            'split': [name for name in KINDS if name not in SHARES or name == camera],
            'single': [
                name for name in (camera, 'init_roi', 'detections', 'heat_map') if name in KINDS
            ],
            'alone': [camera],
        }
        self._publishers = {
            f'{space}/{topic}': self.node.create_publisher(
                KINDS[topic],
                f'{space}/{topic}',
                LATCHED if topic == 'image_size' else QoSProfile(depth=200),
            )
            for space, topics in read.items()
            for topic in topics
        }
        self._services = {
            (name, service): self.node.create_client(kind, f'/{space}/{name}/{service}')
            for space, names in SPACES.items()
            for name in names
            for service, kind in SERVICES.items()
        }

    def connected(self) -> bool:
        """Tell whether all nodes are active, hear this client and are heard."""
        wanted = {f'{space}/{name}' for space, names in SPACES.items() for name in names}
        return wanted <= self.active() and all(map(self.subscribers, ANSWERS)) and all(
            made.get_subscription_count()
            >= 1 + (topic.removeprefix('split/') in _TWO_READERS)
            for topic, made in self._publishers.items()
        )  # fmt: skip

    def fire(self, shot: Shot) -> None:
        """Publish a message to all nodes that read it."""
        for space in SPACES:
            publisher = self._publishers.get(f'{space}/{shot.topic}')
            if publisher is not None:
                publisher.publish(shot.message)

    def ask(self, call: Call) -> bool:
        """Call a service; return whether an answer has come."""
        client, done = self._services[call.node, call.service], threading.Event()
        if not client.service_is_ready():
            return False
        client.call_async(call.request).add_done_callback(lambda _: done.set())
        return done.wait(PATIENCE_S if call.answered else REFUSED_S)

    def missing(self, stamp_ns: int, topics: tuple[str, ...] = tuple(ANSWERS)) -> list[str]:
        """Return the topics on which a good frame has not been answered."""
        with self.lock:
            return [topic for topic in topics if not self.answers[stamp_ns][topic]]

    def heard(self, topic: str, stamp_ns: int, frame_id: str, message: bytes) -> None:
        """Count the answers to good frames."""
        if frame_id == GOOD and stamp_ns in self.answers:
            self.answers[stamp_ns][topic] += 1


class Fuzz:
    """One run against nodes with one topic of the camera."""

    def __init__(self, camera: str, seed: int, logs: Path) -> None:
        """Start the nodes."""
        film = SyntheticSequence(
            SyntheticConfig(seed=3, width=SIZE[0], height=SIZE[1], frames=30, person_height=120.0)
        )
        images, box = [frame.image for frame in film], film.initial_box
        assert box is not None
        self.sent: Counter[str] = Counter()
        self.failures: list[str] = []
        self._images = [*images, *images[-2:0:-1]]
        self._camera, self._rng = camera, Random(f'{seed} {camera}')
        # Of an image that is compressed all others are as with raw ones.
        compressed = camera != 'image'
        self._sets = [camera] if compressed else [each for each in SETS if 'compr' not in each]
        self._number, self._recent = 0, list[str]()
        self.nodes = Nodes(
            logs,
            f'initial_box:=[{box.x:.2f}, {box.y:.2f}, {box.width:.2f}, {box.height:.2f}]',
            f'image_transport:={"compressed" if compressed else "raw"}',
        )
        self.client = Client(camera)

    def close(self) -> None:
        """Stop everything."""
        self.client.close()
        self.nodes.stop()

    def run(self, messages: int, until_s: float) -> bool:
        """Send messages, print what came of it, say whether all holds."""
        if not self._connect():
            print('MISS the nodes do not start')
            return False
        for _ in range(SETTLING):
            self._show()
        before, said, began = self.nodes.look(), self.nodes.lines(), time.monotonic()
        while self.sent.total() < messages and time.monotonic() < until_s:
            self._recent = self._recent[-2 * BURST :]
            for place in range(self._rng.randint(1, BURST)):
                self._spoil(place)
            self._show()
            self.nodes.look()
        seconds = time.monotonic() - began
        for name, count in sorted(self.sent.items()):
            print(f'{count:7}  {name}')
        logged = self.nodes.lines() - said
        found = self.client.answers.values()
        most = max(self.nodes.peak[name] - first for name, first in before.items())
        lost = sum(any(not each[topic] for topic in ANSWERS) for each in found)
        twice = sum(any(each[topic] > 1 for topic in ANSWERS) for each in found)
        print(f'{self._camera}: {self.sent.total()} messages in {seconds:.0f} s')
        checks = [
            holds('exits', self.nodes.exits.total(), 0),
            holds('failures', len(self.failures), 0),
            holds(f'of {len(found)} frames lost', lost, 0),
            holds('of them answered twice', twice, 0),
            holds('lines a second', logged.total() / seconds, LINES_PER_SECOND),
            holds('growth in MiB', most, GROWTH_MIB),
        ]
        return all(checks)

    def _connect(self) -> bool:
        with self.client.lock:
            self.client.status.clear()
        return wait(lambda: bool(self._revived()) or self.client.connected(), START_S)

    @property
    def _stamp_ns(self) -> int:
        """Return the stamp of the newest good frame."""
        return 1_000_000_000_000 + self._number * STEP_NS

    def _show(self) -> None:
        """Show a good frame and wait for the answers to it."""
        self._number += 1
        stamp_ns, image = self._stamp_ns, self._images[self._number % len(self._images)]
        with self.client.lock:
            self.client.answers[stamp_ns] = Counter()
        self.client.fire(Shot(self._camera, good(self._camera, image, header(stamp_ns, GOOD))))
        ended = list[str]()

        def settled() -> bool:
            if self.client.missing(stamp_ns):
                ended.extend(self._revived())
                return bool(ended)
            return True

        wait(settled, PATIENCE_S, 0.002)
        missing = self.client.missing(stamp_ns)
        if missing and not ended:
            self._fail(f'good frame {self._number} is not answered on {", ".join(missing)}')
        if ended:
            self._connect()

    def _spoil(self, place: int) -> None:
        """Send a set between two good frames, or a request."""
        rng, image = self._rng, self._images[self._number % len(self._images)]
        if rng.random() < 0.15:
            name, asked = calls(rng)
            self._note(name, len(asked))
            for each in asked:
                answered = self.client.ask(each)
                if each.answered and not answered and not self._revived():
                    self._fail(f'{each.node}/{each.service} is not answered')
            if any(each.pauses for each in asked) and not self._connect():
                self._fail('not connected again')
            return
        name = rng.choice(self._sets)
        if len(SETS[name]) > 1:
            # Else what the nodes make of the frames before comes in the middle of the set, with
            # stamps that go back, and nothing is joined.
            wait(lambda: not self.client.missing(self._stamp_ns, ('split/mask',)), MASKS_S, 0.005)
        # Only of a frame that it has seen does the tracker learn, or take a map.
        seen = name in ('feedback', 'heat_map')
        stamp_ns = self._stamp_ns + (0 if seen else (place + 1) * APART_NS)
        how, found = shots(name, rng, image, header(stamp_ns, 'bad'))
        self._note(how, len(found))
        for shot in found:
            self.client.fire(shot)

    def _note(self, name: str, count: int) -> None:
        self._recent.append(name)
        self.sent[name] += count

    def _revived(self) -> list[str]:
        """Start what has ended again; return what has."""
        ended = self.nodes.revive()
        for each in ended:
            self._fail(each)
        return ended

    def _fail(self, what: str) -> None:
        self.failures.append(what)
        print(f'MISS {what}\n     after {"; ".join(self._recent)}', flush=True)


def main() -> int:
    """Send, measure, print, and say whether what is promised holds."""
    parser = fuzz_parser(__doc__ or '', minutes=20.0)
    parser.add_argument('--messages', type=int, default=20_000, metavar='N')
    parser.add_argument('--logs', type=Path, metavar='FOLDER', help='keep what the nodes log')
    options = parser.parse_args()
    print(f'seed {options.seed}', flush=True)
    fine, end = True, time.monotonic()
    with ros(), tempfile.TemporaryDirectory() as scratch:
        for camera, share in SHARES.items():
            end += 60 * share * options.minutes
            logs = (options.logs or Path(scratch)) / camera.replace('/', '_')
            fuzz = Fuzz(camera, options.seed, logs)
            try:
                fine &= fuzz.run(round(options.messages * share), end)
            finally:
                fuzz.close()
    return 0 if fine else 1


if __name__ == '__main__':
    sys.exit(run_tool('fuzz_messages.py', main))
