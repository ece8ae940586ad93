# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``gait_replay``: recordings through the pipeline, every frame, into a bag and more."""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections import Counter
from pathlib import Path

from gait_segmentation.cli.jobs import Job, Report, replay_all
from gait_segmentation.cli.outputs import OUTPUTS
from gait_segmentation.cli.tool import (
    FAILED,
    INTERRUPTED,
    PROCESSORS,
    READING,
    Settings,
    add_config_options,
    add_reading_options,
    check_ranges,
    command_parser,
    preset_file,
    read_parameter_file,
    run_tool,
)
from gait_segmentation.config import overridden, replaced
from gait_segmentation.detector.networks import SHIPPED, open_networks
from gait_segmentation.errors import ConfigError
from gait_segmentation.geometry import Box
from gait_segmentation.inputs.folder import is_picture

_DAMAGED = 1

DESCRIPTION = """\
Run recordings through the pipeline in lockstep: every frame, and the same bits
on every run. An input is a film, a folder of images, a rosbag2 (folder, .mcap
or .db3) or a ROS 1 bag; neither reading nor writing needs ROS.
"""

EPILOG = """\
It writes bags, OUT/NAME, and what else is asked for. With several inputs every
FILE and DIR is a folder, and gets a file or folder NAME (with its suffix) for
each input. NAME is the input's without suffix.

Outputs that exist are not made again, so an interrupted run is continued by
the same command; --force makes them again. What is of another kind is never
replaced, with --force neither, and nothing is written over or into an input.
Ctrl-C or an error leave what was done as NAME.partial, which can be read.

Stamps are those of the headers in a bag (the time of recording where a header
has none); frame N of a film has the stamp (N + 1) / fps, or its own time where
the film says otherwise.

exit code: 0, 1 if an input was damaged (all frames before the damage came
out), 2 if an input could not be replayed, 130 if interrupted

examples (after colcon build with "ros2 run gait_segmentation" in front)
  gait_replay walk.mp4 --box 400 120 80 260 --overlay walk-overlay.mp4
  gait_replay bags/* --out out/replay --opengait silhouettes --jobs 2
  gait_replay bags/* --opengait silhouettes --dask tcp://host:8786
  gait_replay walk.mp4 --box 400 120 80 260 --preset paper
  gait_replay robot.bag --topic /camera/image_raw --set people.max_people=3
"""


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    made = command_parser('gait_replay', DESCRIPTION, EPILOG)
    add = made.add_argument
    add('input', nargs='+', type=Path, metavar='INPUT', help='films, folders of images, bags')
    for kind in OUTPUTS:
        metavar = 'FILE' if kind.files is None else 'DIR'
        add(kind.option, type=Path, default=kind.default, metavar=metavar, help=kind.help)
    add(
        '--box',
        type=float,
        nargs=4,
        metavar=('X', 'Y', 'W', 'H'),
        help='tight box of a person in the first frame, in pixels of the input; without it '
        'people are found',
    )
    maps = made.add_mutually_exclusive_group()
    maps.add_argument(
        '--heat-map',
        default='',
        metavar='DIR|TOPIC',
        help='heat maps of people as evidence beside the own: a folder of grey images named by '
        'frame number (from 0) or stamp in ns, or a topic of the bag',
    )
    maps.add_argument(
        '--detector',
        metavar='NETWORK',
        help='what looks at whole images: people (the default), boxes, none, or FILE.onnx; the '
        'same as --set detector.network=NETWORK',
    )
    add_reading_options(made, 'films: their own; folders: 30')
    add_config_options(made)
    add('--params', type=Path, metavar='FILE', help='ROS parameter file, as for the nodes')
    add('--bank', default='', metavar='FILE', help='template bank, as gait_bank writes it')
    workers = made.add_mutually_exclusive_group()
    workers.add_argument(
        '--jobs',
        type=int,
        default=1,
        metavar='N',
        help='inputs at a time, in processes of their own (%(default)s)',
    )
    workers.add_argument(
        '--dask',
        default='',
        metavar='ADDRESS',
        help='have the workers of a Dask cluster do it; its scheduler, such as tcp://host:8786',
    )
    add('--force', action='store_true', help='make existing outputs again')
    return made


def main(arguments: list[str] | None = None) -> int:
    """Run the command and return its exit code."""
    return run_tool('gait_replay', lambda: _replay_all(parser().parse_args(arguments)))


def make_jobs(options: argparse.Namespace) -> list[Job]:
    """Return what is to be done; ConfigError if an option cannot be used."""
    check_ranges(options, {'jobs': PROCESSORS})
    settings = Settings()
    for path in (options.preset and preset_file(options.preset), options.params):
        if path is not None:
            settings = read_parameter_file(path, settings)
    for path in options.input:
        if is_picture(path):
            raise ConfigError(f'{path} is a single picture: give the folder, {path.parent}')
    config = overridden(settings.config, options.set)
    if options.detector:
        config = replaced(config, 'detector', 'network', options.detector)
    if config.detector.network not in SHIPPED and not options.dask:
        # Before anything is written.
        open_networks(config.detector.network, config.detector.person_class)
    several = len(options.input) > 1
    # Machines of a cluster are in other folders.
    here = Path.cwd() if options.dask else Path()
    bank, heat_map = options.bank or settings.bank.bank, options.heat_map
    jobs = []
    for path, name in zip(options.input, names_of(options.input), strict=True):
        outputs = {}
        for kind in OUTPUTS:
            given = getattr(options, kind.option.strip('-'))
            if given is not None:
                outputs[kind] = here / kind.place(given, name, several=several)
        jobs.append(
            Job(
                input=here / path,
                config=config,
                outputs=outputs,
                reading={each: getattr(options, each) for each in READING},
                bank=bank and str(here / bank),
                box=Box(*options.box) if options.box is not None else settings.start.box(),
                heat_map=str(here / heat_map) if os.path.isdir(heat_map) else heat_map,
            )
        )
    return jobs


def names_of(paths: list[Path]) -> list[str]:
    """Return names of outputs: those of the inputs, with their folders' where two are the same."""
    # Not by Path.resolve, which some versions of Python let fail at links in a circle.
    paths = [Path(os.path.realpath(path)) for path in paths]
    names = [path.name if path.is_dir() else path.stem for path in paths]
    often = {name for name, count in Counter(names).items() if count > 1}
    names = [
        f'{path.parent.name}_{name}' if name in often else name
        for path, name in zip(paths, names, strict=True)
    ]
    for name, count in Counter(names).items():
        if count > 1:
            raise ConfigError(f'{count} inputs have the name {name}; replay them one by one')
    return names


def _replay_all(options: argparse.Namespace) -> int:
    wanted = make_jobs(options)
    vocabulary = wanted[0].config.segmentation.vocabulary
    maps = wanted[0].heat_map if os.path.isdir(wanted[0].heat_map) else ''
    given = [*options.input, options.params, wanted[0].bank, vocabulary, maps]
    read = [Path(each) for each in given if each]
    for job in wanted:
        job.check(read)
    jobs = []
    for job in wanted:
        missing = job.missing(force=options.force)
        if missing:
            jobs.append(job)
        if there := ', '.join(
            str(job.outputs[kind]) for kind in job.outputs if kind not in missing
        ):
            print(
                f'{job.input}: done before, of this or another input, and left as it is: {there}; '
                '--force makes it again'
            )
    reports: list[Report] = []
    if jobs:
        started = time.monotonic()
        reports = replay_all(jobs, options.jobs, force=options.force, cluster=options.dask)
        place = jobs[0].bag if len(jobs) == 1 else options.out
        _print(reports, time.monotonic() - started, place)
    if left := len(jobs) - len(reports):
        print(f'gait_replay: interrupted before {left} of the inputs', file=sys.stderr)
    if left or any(report.interrupted for report in reports):
        return INTERRUPTED
    if any(report.error for report in reports):
        return FAILED
    return _DAMAGED if any(report.damaged for report in reports) else 0


def _print(reports: list[Report], seconds: float, place: Path) -> None:
    """Print how it went; ``place`` is where the bags are."""
    for report in reports:
        about = '' if str(report.input) in report.error else f'{report.input}: '
        said = [f'{report.input}: {note}' for note in report.notes]
        said += [f'warning: {report.damaged}'] * bool(report.damaged)
        said += [f'error: {about}{report.error}'] * bool(report.error)
        said += [f'{report.input}: interrupted'] * report.interrupted
        said += [f'{path} was left incomplete' for path in report.left]
        if report.frames and not (report.seen or report.error or report.interrupted):
            said.append(
                f'{report.input}: no person was found: {report.looked}; people below 30 '
                'pixels, in the dark or upside down are hard to see: --box says where one is, '
                '--rotate turns the images'
            )
        for text in said:
            print(f'gait_replay: {text}', file=sys.stderr)
    frames = sum(report.frames for report in reports)
    if frames:
        seen = sum(report.seen for report in reports)
        where = '' if any(report.left for report in reports) else f'; see {place}'
        print(
            f'{frames} frame{"s" * (frames != 1)} in {seconds:.1f} s, '
            f'{frames / max(seconds, 1e-9):.1f} a second, {seen} with people{where}'
        )


if __name__ == '__main__':
    sys.exit(main())
