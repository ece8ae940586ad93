# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``gait_demo``: a film as a live camera, the three nodes over DDS, pictures and a report."""

from __future__ import annotations

import argparse
import math
import os
import signal
import sys
import time
from collections.abc import Mapping, MutableMapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tqdm import tqdm

from gait_segmentation.cli.clip import CLIP_BOX, CLIP_START, demo_clip
from gait_segmentation.cli.processes import ProcessError, ProcessGroup, handled
from gait_segmentation.cli.replaying.mark import png_is_marked
from gait_segmentation.cli.tool import (
    POLL_S,
    add_preset_option,
    command_parser,
    make_folder,
    preset_file,
    run_tool,
)
from gait_segmentation.errors import ConfigError, InputError
from gait_segmentation.files.output_files import keep_apart
from gait_segmentation.geometry import Box, check_start_box
from gait_segmentation.inputs import ImageSource, open_input
from gait_segmentation.people import MOST_PEOPLE
from gait_segmentation.ros.files import use_shared_memory

if TYPE_CHECKING:
    from gait_segmentation.cli.recorder import Record, Recorder

__all__ = ['main', 'parser']

NODES = ('gait_tracker', 'gait_matcher', 'gait_segmenter')
_WRITTEN = ('masks', 'overlay.mp4', 'contact_sheet.png', 'phase.png', 'report.json', 'logs')
_START_TIMEOUT_S = 900.0
_PRELOADED = 1 << 30
"""Bytes of frames that are decoded beforehand; longer films are while they are played."""
_FLOW_OUT_S = 5.0

# A demonstration on a busy computer is to be late rather than to have gaps.
_PATIENT = ('-p', 'backlog:=90')
_KEEP = ('-p', 'keep_images:=300')

DESCRIPTION = """\
Show the package at work on this computer.

A film is played as a live camera at its own rate; gait_tracker, gait_matcher
and gait_segmenter run as separate processes, as on a robot, and everything they
publish is recorded. The film shows a woman walking past a static camera (from
the package Sports2D, BSD-3-Clause, downloaded once); --clip plays another.
"""

EPILOG = """\
writes to the output folder
  masks/NNNN.png     the silhouettes, named by the frame's number in the film
  overlay.mp4        the film with outline, box, direction and phase
  contact_sheet.png  28 frames of the person with outline
  phase.png          gait phase and direction over time
  report.json        frames in and out, dropped, fps, latency from the frame's
                     stamp to its mask, frames tracked
  logs/NAME.log      what the processes logged

examples (after colcon build with "ros2 run gait_segmentation" in front)
  gait_demo
  gait_demo --preset paper --out out/paper
  gait_demo --clip walk.mp4 --out out/walk
  gait_demo --clip walk.mp4 --box 400 120 80 260 --start 15 --out out/walk
  gait_demo --box auto --people 3
"""


class _Help(argparse.RawDescriptionHelpFormatter):
    """Shows the words of --box as they are to be given: argparse knows one word or many alike."""

    def _format_args(self, action: argparse.Action, default_metavar: str) -> str:
        if action.dest == 'box':
            return str(action.metavar)
        return super()._format_args(action, default_metavar)


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    made = command_parser('gait_demo', DESCRIPTION, EPILOG, _Help)
    add = made.add_argument
    add('--out', type=Path, default=Path('out/demo'), help='output folder (%(default)s)')
    add('--clip', type=Path, metavar='FILE', help='a film, folder of images or bag of your own')
    add(
        '--box',
        nargs='+',
        metavar='auto|X Y W H',
        help='tight box of the person in the first frame played, in pixels of the film; auto, and '
        'with --clip without --box, people are found by their walk',
    )
    add('--people', type=int, default=1, metavar='N', help='people at a time (%(default)s)')
    add_preset_option(made)
    add('--start', type=int, metavar='N', help='first frame played, counted from 0')
    add('--count', type=int, metavar='M', help='number of frames played (all)')
    add('--width', type=int, default=960, metavar='PX', help='width played (%(default)s)')
    add('--rate', type=float, default=0.0, metavar='HZ', help="frames per second (the film's)")
    return made


def main(arguments: list[str] | None = None) -> int:
    """Run the command and return its exit code."""
    # Stopping the demonstration must stop its processes.
    with handled(signal.default_int_handler, signal.SIGTERM):
        return run_tool('gait_demo', lambda: _show(parser().parse_args(arguments)))


def _show(options: argparse.Namespace) -> None:
    report = run(options)
    latency = report['latency_ms']
    print(
        f'{report["frames_out"]} of {report["frames_in"]} frames at {report["fps"]:.1f} fps, '
        f'{report["tracked_frames"]} with a silhouette; latency {latency["p50"]:.0f} ms, '
        f'95 % within {latency["p95"]:.0f} ms; see {options.out}'
    )


def run(options: argparse.Namespace) -> dict[str, Any]:
    """
    Play the film through the nodes and write everything.

    :returns: the report.
    :raises GaitSegmentationError: if the film cannot be used or a process fails.
    """
    film, box = _film_and_box(options)
    keep_apart([('--out', options.out / name) for name in _WRITTEN], [film.path])
    _check_masks(options.out / 'masks')
    make_folder('--out', options.out)
    prepare_environment(os.environ)
    # Here, so that it finds the environment prepared and --help needs no ROS.
    import rclpy
    from rclpy.signals import SignalHandlerOptions

    from gait_segmentation.cli.demo_output import (
        make_report,
        write_masks,
        write_phase,
        write_pictures,
        write_report,
    )
    from gait_segmentation.cli.recorder import Recorder

    logs = options.out / 'logs'
    stamps = logs / 'stamps.txt'
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    try:
        with ProcessGroup(os.environ, logs) as processes:
            preset = None if options.preset is None else preset_file(options.preset)
            start_nodes(processes, box, options.people, preset)
            recorder = Recorder(options.people)
            try:
                holds = '' if preset is None else 'gait_matcher'
                play(processes, recorder, film, options.rate, stamps, holds=holds)
            finally:
                recorder.close()
    finally:
        rclpy.try_shutdown()
    published = read_stamps(stamps)
    frames = frames_shown(published, recorder)
    lost = len(published) - len(frames)
    if lost:
        print(f'gait_demo: {lost_frames(lost, recorder.dropped(), logs)}', file=sys.stderr)
    out = options.out
    write_masks(out / 'masks', frames)
    rate = options.rate or film.fps
    write_pictures(out / 'overlay.mp4', out / 'contact_sheet.png', frames, film, rate)
    write_phase(options.out / 'phase.png', frames)
    topics = {topic: recorder.received(topic) for topic in recorder.topics}
    report = make_report(len(published), frames, topics)
    write_report(options.out / 'report.json', report)
    return report


def _check_masks(folder: Path) -> None:
    """
    Refuse a folder of images that are not masks of an earlier demonstration, which are removed.

    :raises ConfigError: if it holds such.
    """
    for path in folder.glob('*.png'):
        if not (path.is_file() and png_is_marked(path)):
            raise ConfigError(
                f'--out: {path} was not made by gait_demo and is not replaced; remove it or '
                'choose another folder'
            )


def _film_and_box(options: argparse.Namespace) -> tuple[ImageSource, Box | None]:
    """Return the film and the person's box in the pixels that are played, None to find people."""
    auto = options.box == ['auto']
    box = None if auto else _numbers(options.box)
    if options.clip is None:
        if box is not None or options.start is not None:
            raise ConfigError('--box and --start belong to a film of your own: give --clip too')
        path, start = demo_clip(), CLIP_START
        box = None if auto else CLIP_BOX
    else:
        path, start = options.clip, options.start or 0
    if not 1 <= options.people <= MOST_PEOPLE:
        raise ConfigError(f'--people must be from 1 to {MOST_PEOPLE}, got {options.people}')
    if options.width < 64 or options.rate < 0:
        raise ConfigError(
            f'--width must be at least 64 and --rate positive, got {options.width} and '
            f'{options.rate:g}'
        )
    film = open_input(path, width=options.width, start=start, count=options.count)
    if box is None:
        return film, None
    scaled = box.scaled(film.scale)
    try:
        check_start_box(scaled, film.size)
    except InputError as error:
        raise ConfigError(f'--box {" ".join(options.box)}: {error}') from error
    return film, scaled


def _numbers(words: list[str] | None) -> Box | None:
    """Return the box that four words give."""
    if words is None:
        return None
    try:
        x, y, width, height = (float(word) for word in words)
    except ValueError:
        raise ConfigError(
            f'--box must be four numbers X Y W H, or auto, got {" ".join(words)!r}'
        ) from None
    return Box(x, y, width, height)


def prepare_environment(environment: MutableMapping[str, str]) -> None:
    """Keep the demonstration to this computer and apart from other ROS systems on it."""
    environment.setdefault('ROS_DOMAIN_ID', str(20 + os.getpid() % 80))
    environment.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    environment.setdefault('RMW_IMPLEMENTATION', 'rmw_fastrtps_cpp')
    use_shared_memory(environment)


def start_nodes(
    processes: ProcessGroup, box: Box | None, people: int = 1, preset: Path | None = None
) -> None:
    """
    Start tracker, matcher and segmenter; without a first box they find people themselves.

    :param preset: a parameter file for all of them.
    """
    package = 'gait_segmentation'
    start: tuple[str, ...] = ('-p', 'starting.auto_init:=motion')
    if box is not None:
        numbers = ', '.join(f'{value:.2f}' for value in (box.x, box.y, box.width, box.height))
        start = ('-p', f'initial_box:=[{numbers}]')
    given = () if preset is None else ('--params-file', str(preset))
    common = ('--ros-args', *given, *_PATIENT, '-p', f'max_people:={people}')
    processes.start('gait_tracker', package, 'tracker', *common, *start)
    processes.start('gait_matcher', package, 'matcher', *common)
    processes.start('gait_segmenter', package, 'segmenter', *common, *_KEEP)


def play(
    processes: ProcessGroup,
    recorder: Recorder,
    film: ImageSource,
    rate: float,
    stamps: Path,
    holds: str = '',
) -> None:
    """
    Play the film and wait until everything has come.

    :param rate: frames per second, 0 = the film's.
    :param stamps: file for the frames' numbers and stamps.
    :param holds: the one that may hold back the last frames for some that do not come.
    :raises ProcessError: if a process fails or the nodes do not connect.
    """
    stamps.unlink(missing_ok=True)
    print('gait_demo: starting the nodes (the first time, a minute or two)', file=sys.stderr)
    deadline = time.monotonic() + _START_TIMEOUT_S
    ready: set[str] = set()
    while not recorder.connected(*NODES):
        processes.check_running(*NODES)
        for name in recorder.active() - ready:
            ready.add(name)
            print(f'gait_demo: {name} is ready', file=sys.stderr)
        if time.monotonic() > deadline:
            raise ProcessError(f'the nodes did not connect within {_START_TIMEOUT_S:g} s')
        time.sleep(POLL_S)
    source = [str(film.path), '--width', str(film.size[0]), '--start', str(film.start)]
    source += ['--wait-for', '2', '--stamps', str(stamps)]
    if film.total is not None and 3 * math.prod(film.size) * film.total <= _PRELOADED:
        source.append('--preload')
    # For the processes to be done with finding the camera before it starts.
    source += ['--delay', '1']
    source += ['--rate', str(rate)] if rate else []
    source += ['--count', str(film.count)] if film.count else []
    processes.start('gait_source', 'gait_segmentation', 'source', *source)
    # disable=None: no bar where stderr is not a terminal.
    with tqdm(unit='frame', disable=None, desc='gait_demo') as bar:
        # Not asked of the bar, which does not count where it is not shown.
        shown = came = 0
        quiet_since = time.monotonic()
        while True:
            processes.check_running(*NODES)
            played = processes.ended('gait_source')
            complete, messages = recorder.complete(), recorder.messages()
            if messages > came or not played:
                quiet_since = time.monotonic()
            bar.update(complete - shown)
            shown, came = complete, messages
            if played:
                quiet = time.monotonic() - quiet_since > _FLOW_OUT_S
                if complete >= len(read_stamps(stamps)) or (quiet and not holds):
                    return
                if quiet:
                    recorder.deactivate(holds)
                    holds, quiet_since = '', time.monotonic()
            time.sleep(POLL_S)


def lost_frames(lost: int, dropped: Mapping[str, int], logs: Path) -> str:
    """
    Say why frames have no mask, and what can be done.

    :param lost: how many there are.
    :param dropped: frames that each node says it has dropped.
    :param logs: the folder of the logs.
    """
    if dropped:
        who = ' and '.join(f'{name} dropped {count}' for name, count in sorted(dropped.items()))
        why = f'{who}, which could not keep up: close other programs, or give a lower --rate or '
        why += '--width'
    else:
        why = 'no node says that it dropped them, so they were lost on the way between the nodes: '
        why += f'see what they say in {logs}'
    return f'{lost} frame{"s" * (lost != 1)} lost: {why}'


def read_stamps(path: Path) -> dict[int, int]:
    """Return the stamps in nanoseconds by frame number."""
    pairs = (line.split() for line in path.read_text(encoding='ascii').splitlines())
    return {int(number): int(stamp_ns) for number, stamp_ns in pairs}


def frames_shown(published: dict[int, int], recorder: Recorder) -> list[Record]:
    """Return the frames of which a mask has come, with their numbers and times."""
    first, shown = min(published.values(), default=0), []
    for number, stamp in published.items():
        record = recorder.records.get(stamp)
        if record is not None and record.packed is not None:
            record.number, record.time_s = number, (stamp - first) / 1e9
            shown.append(record)
    return shown


if __name__ == '__main__':
    sys.exit(main())
