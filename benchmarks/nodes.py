#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The nodes as processes before a film, as somebody who subscribes to the mask sees them.

Synthetic walkers, the first 0.62 of the image high, walk to and fro before the camera of
gait_demo, at 30 frames per second; the three nodes (split) or gait_pipeline (single) run with
their defaults, but for ``--preset`` and ``-p``.  Needs ROS 2; leave the machine alone meanwhile.
The first call is for whoever chooses a robot's computer, or compares with a network::

    python benchmarks/nodes.py --sizes 640x480 1280x720 --walkers 1 4 --seconds 20
        [--onnx yolo11n-seg.onnx]
    python benchmarks/nodes.py [--seconds 60] [--json FILE] [--rate 15]
        [-p matching.kernel:=direct_access_table ...]
    python benchmarks/nodes.py --preset paper --styles split --rate 15 --seconds 30
    python benchmarks/nodes.py --people 1 --styles single --seconds 1800
    python benchmarks/nodes.py --sequences FOLDER ...
    python benchmarks/nodes.py --kills 50

One walker is given by a box, more have to be found: ``people`` is how many have a slot, on
average.  Latencies from a frame's stamp to its mask, in ms, are over all frames answered, of which
there are so many ``per_second``; ``lost`` counts frames without a mask that were published after
the first second, ``lost_first_second`` those before, ``first`` is the latency of the first frame
of all.  With a lag, the frames that ``gait_matcher`` still holds when the film ends are neither.
``cpu_percent`` (of one core, the source not counted) and ``rss_mib`` are of all nodes together;
``drift`` is the change of that memory over the last third, ``slower`` the 95th percentile of the
last third over that of the first.  ``--json`` has all of these, by film and style.  ``network
alone`` is ``--onnx`` in OpenCV on one thread, up to its outputs: what makes masks of these is not
in it.

``--people`` has people found in scenes of 640 x 480 in which three come, cross and go, with a
second of nothing but noise between.  ``--sequences`` plays clips with truth at their own
rate through the three nodes; a frame without a mask counts as nobody seen, and J may be 0.02 less
than in lockstep.  ``--kills`` kills each node so many times under a stream, at moments drawn by
lot, and starts it again as a launch file with ``respawn`` does: a frame shown after the kill must
be answered within 3 s, the start of Python included (the kernels must be in Numba's cache).  A
node that gives none within 20 s counts as hung: its stacks are printed (SIGUSR1), and it must end
within 5 s of SIGTERM.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import signal
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from sensor_msgs.msg import Image

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))


from benchmarks import holds
from benchmarks.synthetic import SyntheticConfig, SyntheticSequence
from gait_segmentation.cli.tool import (
    add_preset_option,
    preset_file,
    read_parameter_file,
    run_tool,
)
from gait_segmentation.detector.onnx_file import OnnxFile
from gait_segmentation.errors import SequenceError
from gait_segmentation.geometry import Box
from gait_segmentation.inputs import open_input
from gait_segmentation.pipeline import Pipeline
from gait_tools.demo.nodes import NODES, Listener, ProcessError, ProcessGroup, ros
from gait_tools.demo.recording import play as play_film
from gait_tools.evaluation.metrics import jaccard
from gait_tools.evaluation.runner import run
from gait_tools.evaluation.sequence import Sequence
from gait_tools.evaluation.session import load_sequences

STYLES = {'split': NODES, 'single': ('gait_pipeline',)}
START_TIMEOUT_S, POLL_S = 180.0, 0.02

PERSON = 0.62
"""Height of the first walker over that of the image."""

COLUMNS = 'people', 'per_second', 'lost', 'p50', 'p95', 'max', 'first', 'cpu_percent', 'rss_mib'
"""What is printed; the rest is in ``--json``."""

BARS = {
    ('640x480', 'split'): {'p95': 33.0, 'lost': 0, 'cpu_percent': 100.0, 'first': 100.0},
    ('640x480', 'single'): {'p95': 20.0, 'lost': 0, 'first': 100.0},
    ('1280x720', 'split'): {'p95': 50.0, 'lost': 0},
}
LONG = {'lost': 0, 'drift': 0.01, 'slower': 1.2}
"""Bars of the scenes with people who come and go."""

LIVE = 0.02
"""How much less than in lockstep J may be."""

BACK_S, HUNG_S, TERM_S, STEADY_S = 10.0, 20.0, 5.0, 0.5
"""Of a node that is killed; frames are answered for as long before the next kill, at least."""

STACKS = 100
SCENES, SCENE_FRAMES, NOISE_FRAMES = 3, 150, 30
SAMPLE_S = 0.2
STEPS = 60
FLOW_OUT_S = 3.0
NETWORK_FRAMES = 30


def processor_seconds(pid: int) -> float:
    """Return the processor time a process has taken."""
    fields = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')


def resident_mib(pid: int) -> float:
    """Return the resident memory of a process, NaN if it has just ended."""
    try:
        pages = Path(f'/proc/{pid}/statm').read_text().split()
    except FileNotFoundError:
        pages = []
    return int(pages[1]) * os.sysconf('SC_PAGE_SIZE') / 2**20 if pages else float('nan')


def wait(done: Callable[[], bool], timeout_s: float, poll_s: float = POLL_S) -> bool:
    """Wait until something is so; return whether it is."""
    deadline = time.monotonic() + timeout_s
    while not done():
        if time.monotonic() > deadline:
            return False
        time.sleep(poll_s)
    return True


@contextmanager
def session() -> Iterator[tuple[ProcessGroup, Listener]]:
    """Have processes, and who listens to the mask as a user would."""
    with (
        ros(),
        tempfile.TemporaryDirectory() as logs,
        ProcessGroup(Path(logs)) as processes,
        closing(Listener({'mask': Image})) as listener,
    ):
        yield processes, listener


def start(
    processes: ProcessGroup,
    nodes: tuple[str, ...],
    listener: Listener,
    *parameters: str,
    box: Box | None = None,
    preset: Path | None = None,
) -> None:
    """
    Start nodes and wait until they are active and connected.

    :param parameters: of all nodes, as ``name:=value``.
    :param box: of a person in the first frame; without, people are found.
    :param preset: the parameter file of all nodes, if any.
    """
    for name in nodes:
        given = list(parameters)
        if box is not None and name in ('gait_tracker', 'gait_pipeline'):
            numbers = f'{box.x:.2f}, {box.y:.2f}, {box.width:.2f}, {box.height:.2f}'
            given.append(f'initial_box:=[{numbers}]')
        words = [word for each in given for word in ('-p', each)]
        if preset is not None:
            words = ['--params-file', str(preset), *words]
        processes.start_node(name, '--ros-args', *words)

    def ready() -> bool:
        processes.check_running(*nodes)
        return listener.connected(nodes)

    if not wait(ready, START_TIMEOUT_S):
        raise ProcessError('the nodes did not connect')


def show(processes: ProcessGroup, frames: Path, stamps: Path, readers: int, rate: float) -> None:
    """Show frames to the nodes again and again."""
    given = {'film': str(frames), 'stamps': str(stamps), 'readers': readers}
    about = json.dumps({**given, 'loop': True, 'rate': rate})
    processes.start('camera', 'gait_tools.demo.camera', about)


def write_walkers(frames: Path, size: tuple[int, int], walkers: int = 1) -> Box:
    """Write frames of walkers to and fro for ever, if looped; return the first box of one."""
    clip = SyntheticSequence(
        SyntheticConfig(
            width=size[0],
            height=size[1],
            frames=STEPS,
            fps=30.0,
            person_height=PERSON * size[1],
            jitter=0.0,
            clutter=0.7,
            walkers=walkers,
        )
    )
    there = [frame.image for frame in clip]
    write_images(frames, [*there, *there[-2:0:-1]])
    assert clip.initial_box is not None
    return clip.initial_box


def write_scenes(frames: Path) -> None:
    """Write the frames of the scenes."""
    noise = np.random.default_rng(0)
    images: list[np.ndarray] = []
    for seed in range(SCENES):
        config = SyntheticConfig(
            seed, *(640, 480, 30.0, SCENE_FRAMES), person_height=150.0, walkers=3
        )
        images += [frame.image for frame in SyntheticSequence(config)]
        images += [noise.integers(0, 256, images[-1].shape, np.uint8) for _ in range(NOISE_FRAMES)]
    write_images(frames, images)


def write_images(folder: Path, images: list[np.ndarray]) -> None:
    """Write images uncompressed, so that decoding does not compete with the nodes."""
    folder.mkdir()
    for number, image in enumerate(images):
        cv2.imwrite(str(folder / f'{number:06d}.bmp'), image)


def size_of(text: str) -> tuple[int, int]:
    """Read a size such as 640x480."""
    width, height = map(int, text.split('x'))
    return width, height


def lag_of(options: argparse.Namespace) -> int:
    """Return how many frames results are delayed by."""
    for each in reversed(options.parameters):
        name, _, value = each.partition(':=')
        if name == 'matching.lag':
            return int(value)
    if options.preset is None:
        return 0
    return read_parameter_file(preset_file(options.preset)).config.matching.lag


def network_ms(path: Path, film: Path) -> float:
    """Return the median time that a network takes for an image of a film, on one thread."""
    cv2.setNumThreads(1)
    network, times = OnnxFile(path), []
    for each in sorted(film.iterdir())[:NETWORK_FRAMES]:
        image = cv2.imread(str(each))
        began = time.perf_counter()
        size = network.width, network.height
        network.run(cv2.dnn.blobFromImage(image, 1 / 255, size, swapRB=True))
        times.append(time.perf_counter() - began)
    return 1e3 * statistics.median(times)


def measure(
    style: str, film: Path, slots: int, box: Box | None, options: argparse.Namespace
) -> dict[str, Any]:
    """Measure one style before the frames of a film."""
    nodes, stamps = STYLES[style], film.with_name('stamps.txt')
    memory, people = [], []
    with session() as (processes, listener):
        parameters = f'max_people:={slots}', *options.parameters
        preset = preset_file(options.preset) if options.preset else None
        start(processes, nodes, listener, *parameters, box=box, preset=preset)
        show(processes, film, stamps, min(len(nodes), 2), options.rate)
        wait(lambda: bool(listener.arrived_s) or processes.ended('camera'), float('inf'))
        pids = [processes.pid(name) for name in nodes]
        began, used = time.monotonic(), sum(map(processor_seconds, pids))
        while (passed := time.monotonic() - began) < options.seconds:
            processes.check_running(*nodes, 'camera')
            memory.append(sum(map(resident_mib, pids)))
            with listener.lock:
                people.append(int(listener.status[nodes[0]]['people']))
            time.sleep(SAMPLE_S)
        used = sum(map(processor_seconds, pids)) - used
        processes.stop('camera')
        time.sleep(FLOW_OUT_S)
        published = [int(line.split()[1]) for line in stamps.read_text().splitlines()]
        arrived = dict(listener.arrived_s)
    if not published or not arrived:
        raise ProcessError(f'{style}: {len(published)} frames published, none answered')
    latency = {t: 1e3 * (arrived[t] - t / 1e9) for t in published if t in arrived}
    # What the matcher holds back for its lag, it gives out when more comes or it is deactivated.
    due = published[: len(published) - lag_of(options)]
    missing = [t for t in due if t not in arrived]
    settled = published[0] + 1_000_000_000
    values = np.array(list(latency.values()))
    found = {f'p{share}': round(float(np.percentile(values, share)), 2) for share in (50, 95, 99)}
    third = max(len(values) // 3, 1)
    first, last = (float(np.percentile(each, 95)) for each in (values[:third], values[-third:]))
    end = memory[-max(len(memory) // 3, 1) :]
    shown_s = (published[-1] - published[0]) / 1e9 + 1 / options.rate
    return found | {
        'people': round(statistics.mean(people), 1),
        'per_second': round(len(latency) / shown_s, 1),
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
    }


def latencies(options: argparse.Namespace) -> list[bool]:
    """Measure all films and styles, print a table, and return what of the bars holds."""
    if options.onnx:
        # Before minutes are spent on the nodes.
        OnnxFile(options.onnx)
    report: dict[str, dict[str, dict[str, Any]]] = {}
    print(f'{"":27s}', *(f'{each:>11s}' for each in COLUMNS), flush=True)
    for size, walkers in product(options.sizes, options.walkers):
        name = f'{size[0]}x{size[1]}' + (f', {walkers} walkers' if walkers > 1 else '')
        report[name] = {}
        with tempfile.TemporaryDirectory() as folder:
            film, box = Path(folder) / 'frames', None
            if options.people:
                write_scenes(film)
            else:
                first = write_walkers(film, size, walkers)
                box = first if walkers == 1 else None
            if options.onnx:
                took = network_ms(options.onnx, film)
                print(f'{name:20s} network alone: {took:.1f} ms per frame', flush=True)
            for style in options.styles:
                found = measure(style, film, options.people or walkers, box, options)
                report[name][style] = found
                values = (f'{found[each]:11g}' for each in COLUMNS)
                print(f'{name:20s} {style:6s}', *values, flush=True)
    fine = []
    if not options.parameters and not options.preset:
        for name, style in product(report, options.styles):
            bars = LONG if options.people else BARS.get((name, style), {})
            found = report[name][style]
            fine += [holds(f'{name} {style} {key}', found[key], bars[key]) for key in bars]
    if options.json:
        options.json.write_text(json.dumps(report, indent=1) + '\n')
    return fine


def played(sequence: Sequence) -> bool:
    """Play a sequence through the three nodes; return whether J is as in lockstep."""

    def score(masks: Mapping[int, np.ndarray]) -> float:
        truths = {n: sequence.truth(n) for n in sequence.numbers}
        values = [
            jaccard(masks.get(n, np.zeros_like(truth)), truth)
            for n, truth in truths.items()
            if truth is not None
        ]
        return float(np.mean(values))

    boxes = sequence.starts.get(sequence.numbers[0], ())
    if len(boxes) != 1:
        raise SequenceError(f'{sequence.name} needs one person, from the first frame on')
    alone = run(Pipeline(), sequence, sequence.numbers, sequence.starts, clock=time.perf_counter)
    wanted = score({each.number: each.mask for each in alone})
    film = open_input(sequence.folder / 'frames')
    with tempfile.TemporaryDirectory() as logs:
        said = play_film(film, Path(logs), box=boxes[0], rate=sequence.fps)
    masks = {sequence.numbers[each]: said.result(each).mask for each in said.answered()}
    more = f'(lockstep {wanted:.4f}, {len(masks)} of {len(sequence.numbers)} frames answered)'
    return holds(f'{sequence.name}, live', score(masks), wanted - LIVE, least=True, more=more)


class Kills:
    """The nodes under a stream, each of which is killed and started again."""

    def __init__(
        self, processes: ProcessGroup, listener: Listener, nodes: tuple[str, ...], frames: Path
    ) -> None:
        """Start everything and wait until frames are answered."""
        self.processes, self.listener, self.nodes = processes, listener, nodes
        self.times_s: dict[str, list[float]] = {name: [] for name in nodes}
        self.hung = self.deaf = 0
        for name in nodes:
            processes.start_node(name)
        show(processes, frames, frames.with_name('stamps.txt'), 0, 30.0)
        if not self.answers_after(time.time_ns(), START_TIMEOUT_S):
            raise ProcessError('no frame was answered')

    def answers_after(self, stamp_ns: int, timeout_s: float) -> bool:
        """Wait until a frame that was shown after a time is answered; return whether it is."""
        arrived = self.listener.arrived_s
        return wait(lambda: max(list(arrived), default=0) > stamp_ns, timeout_s, 0.005)

    def kill(self, name: str) -> None:
        """Kill a node, start it again and wait for its first answer."""
        self.processes.check_running(*self.nodes, 'camera')
        # Older stamps are of no use any more.
        self.listener.arrived_s.clear()
        began_ns = time.time_ns()
        self.signal(name, signal.SIGKILL)
        self.processes.start_node(name)
        if self.answers_after(began_ns, HUNG_S):
            newest = min(stamp for stamp in list(self.listener.arrived_s) if stamp > began_ns)
            self.times_s[name].append(self.listener.arrived_s[newest] - began_ns / 1e9)
            return
        self.hung += 1
        self.signal(name, signal.SIGUSR1)
        time.sleep(1.0)
        print(f'--- {name}\n{self.processes.last_lines(name, STACKS)}', flush=True)
        # All, which may wait for it.
        for each in self.nodes:
            if not self.signal(each, signal.SIGTERM):
                self.deaf += 1
                self.signal(each, signal.SIGKILL)
            self.processes.start_node(each)
        self.answers_after(time.time_ns(), START_TIMEOUT_S)

    def signal(self, name: str, number: signal.Signals) -> bool:
        """Send a signal to a node if it runs; return whether one that is to end it does."""
        if self.processes.ended(name):
            return True
        os.kill(self.processes.pid(name), number)
        ended = partial(self.processes.ended, name)
        return number == signal.SIGUSR1 or wait(ended, TERM_S)


def killed(nodes: tuple[str, ...], kills: int, seed: int) -> bool:
    """Kill each of some nodes that work together a number of times; say whether all holds."""
    chance = random.Random(seed)
    with tempfile.TemporaryDirectory() as folder, session() as (processes, listener):
        frames = Path(folder) / 'frames'
        write_walkers(frames, (640, 480))
        stage = Kills(processes, listener, nodes, frames)
        for _ in range(kills):
            for name in nodes:
                time.sleep(STEADY_S + chance.random())
                stage.kill(name)
    fine = True
    for name, found in stage.times_s.items():
        times = found or [float('inf')]
        about = f'(median {statistics.median(times):.2f}, {len(found)} back)'
        fine &= holds(f'{name}, worst time in s', max(times), BACK_S, more=about)
    return fine & holds('hung', stage.hung, 0, more=f'({stage.deaf} deaf to SIGTERM)')


def main() -> int:
    """Measure, print, and say whether what is promised holds."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = parser.add_argument
    add('--sizes', type=size_of, nargs='+', default=[(640, 480)], metavar='WxH')
    add('--walkers', type=int, nargs='+', default=[1], metavar='N', help='in the film')
    add('--onnx', type=Path, metavar='FILE', help='also time a network, such as YOLO-seg')
    add('--styles', nargs='+', choices=list(STYLES), default=list(STYLES))
    add('--rate', type=float, default=30.0, metavar='HZ')
    add('--seconds', type=float, default=60.0)
    add('-p', dest='parameters', nargs='+', default=[], metavar='NAME:=VALUE', help='of all nodes')
    add_preset_option(parser)
    add('--json', type=Path, metavar='FILE', help='write the figures here')
    add('--people', type=int, default=0, metavar='N', help='play scenes for ever, N slots')
    add('--sequences', type=Path, nargs='+', metavar='FOLDER', help='play clips with truth')
    add('--kills', type=int, default=0, metavar='N', help='kill each node N times')
    add('--seed', type=int, default=1, help='of the kills')
    options = parser.parse_args()
    if options.sequences:
        fine = [played(each) for each in load_sequences(options.sequences)]
    elif options.kills:
        # An installed package has its bytecode.
        os.environ.pop('PYTHONDONTWRITEBYTECODE', None)
        fine = [killed(STYLES[each], options.kills, options.seed) for each in options.styles]
    else:
        fine = latencies(options)
    return 0 if all(fine) else 1


if __name__ == '__main__':
    sys.exit(run_tool('nodes.py', main))
