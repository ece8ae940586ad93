# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What commands share: errors in one line, Ctrl-C without a traceback, options, parameters."""

from __future__ import annotations

import argparse
import io
import os
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gait_segmentation import MOST_PIXELS
from gait_segmentation.config import parameters_of, replaced, stages_of
from gait_segmentation.errors import (
    EXTRAS,
    ConfigError,
    GaitSegmentationError,
    InputError,
    not_installed,
)
from gait_segmentation.files import problem_of, read_yaml, shared_file
from gait_segmentation.geometry import Box, check_start_box
from gait_segmentation.pipeline import PipelineConfig
from gait_segmentation.streams.config import (
    OF_NODES,
    BankConfig,
    StartConfig,
    misnamed,
    qualified,
    sections_of,
)

if TYPE_CHECKING:
    from gait_segmentation.inputs import ImageSource

FAILED, INTERRUPTED = 2, 130
"""Exit codes."""

READING = ('topic', 'width', 'start', 'count', 'rate', 'rotate', 'max_pixels', 'sample_bits')
"""Options that are arguments of :func:`gait_segmentation.inputs.open_input`."""

PROCESSORS = (1, 1024)
"""How many threads or processes may be asked for."""

POLL_S = 0.05
"""How often commands poll."""

_PRESETS = {
    'default': 'gait_segmentation.yaml',
    'paper': 'paper.yaml',
}
"""Installed parameter files by the names they have on the command line."""


_SECTIONS = ('gait_tracker', 'gait_matcher', 'gait_segmenter', 'gait_pipeline', '**', '*')
_UNNAMED = 'people'
"""The stage whose parameters have no prefix in ROS, and here either way."""


def run_tool(name: str, run: Callable[[], int | None]) -> int:
    """
    Run a command and return its exit code.

    :param name: of the command, for what is said on standard error.
    :param run: reads the command line and does the work; what it returns is the exit code, None
        stands for 0.
    :returns: the exit code: 2 after an error of this package or of a file, 130 if interrupted, 1
        if the output is not read any more.
    """
    if isinstance(sys.stdout, io.TextIOWrapper):
        # As standard error: names of files may have letters that the console has not.
        sys.stdout.reconfigure(errors='backslashreplace')
    try:
        try:
            return run() or 0
        finally:
            # Here and not at the end of the interpreter, where an error would leave a traceback.
            sys.stdout.flush()
    except BrokenPipeError:
        # As of "| head".
        _drop_output()
        return 1
    except GaitSegmentationError as error:
        print(f'{name}: error: {error}', file=sys.stderr)
        return FAILED
    except ModuleNotFoundError as error:
        if error.name not in EXTRAS:
            raise
        print(f'{name}: error: {not_installed(error.name)}', file=sys.stderr)
        return FAILED
    except OSError as error:
        _drop_output()
        print(f'{name}: error: {problem_of(error)}', file=sys.stderr)
        return FAILED
    except (KeyboardInterrupt, SystemError) as error:
        # The second is what becomes of it in a kernel that is just being called.
        if isinstance(error, SystemError) and not isinstance(error.__cause__, KeyboardInterrupt):
            raise
        print(f'{name}: interrupted', file=sys.stderr)
        return INTERRUPTED


def _drop_output() -> None:
    """Let what cannot be written, of all that is to be flushed still, go nowhere."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def command_parser(name: str, description: str, epilog: str) -> argparse.ArgumentParser:
    """Return a parser whose texts are shown as they are."""
    raw = argparse.RawDescriptionHelpFormatter
    return argparse.ArgumentParser(name, None, description, epilog, formatter_class=raw)


def add_preset_option(parser: argparse.ArgumentParser) -> None:
    """Add the option that names a preset, None if it is not given; see :func:`preset_file`."""
    parser.add_argument(
        '--preset',
        choices=tuple(_PRESETS),
        help='parameters to begin with, which other options override: paper is the system as '
        'published, see docs/paper.md',
    )


def preset_file(name: str) -> Path:
    """Return the parameter file of a preset; ConfigError if it is not installed."""
    return shared_file(f'config/{_PRESETS[name]}')


def add_config_options(parser: argparse.ArgumentParser) -> None:
    """Add the options that name a preset and change single parameters."""
    add_preset_option(parser)
    parser.add_argument(
        '--set',
        action='append',
        default=[],
        metavar='STAGE.PARAM=VALUE',
        help='change a parameter, e.g. matching.lag=15; may be repeated',
    )


class _Once(argparse.Action):
    """An option that takes one value, and is not to be given again."""

    def __call__(
        self, parser: Any, namespace: Any, values: Any, option: str | None = None
    ) -> None:
        if getattr(namespace, self.dest) != self.default:
            raise argparse.ArgumentError(self, 'may be given once: run again for the other')
        setattr(namespace, self.dest, values)


def add_reading_options(parser: argparse.ArgumentParser, rate: str) -> None:
    """Add the options of what is read, and how; ``rate`` says what the input's own is."""
    add = parser.add_argument
    add('--topic', action=_Once, default='', help='topic of the images, if a bag has several')
    add('--start', type=int, default=0, metavar='N', help='first frame, counted from 0')
    add('--count', type=int, metavar='M', help='number of frames (all)')
    add(
        '--rotate',
        type=int,
        default=0,
        choices=(0, 90, 180, 270),
        help='degrees by which frames are turned clockwise, for a camera on its side or upside '
        'down (%(default)s)',
    )
    add('--width', type=int, default=0, metavar='PX', help='scale down to this width')
    add(
        '--max-pixels',
        type=int,
        default=MOST_PIXELS,
        metavar='N',
        help='refuse frames that have more; of more than %(default)s images in files and bags are '
        'decoded if OPENCV_IO_MAX_IMAGE_PIXELS says so (%(default)s)',
    )
    add(
        '--sample-bits',
        type=int,
        default=16,
        metavar='N',
        help='how many of 16 bits the camera uses, such as 10 or 12 (%(default)s)',
    )
    add('--rate', type=float, default=0.0, metavar='HZ', help=f'frames per second ({rate})')


def check_ranges(options: argparse.Namespace, ranges: Mapping[str, tuple[float, float]]) -> None:
    """Refuse numbers beyond the least and the largest, given by their options: ConfigError."""
    for name, (low, high) in ranges.items():
        value = getattr(options, name)
        # Written so that what is no number is refused.
        if not low <= value <= high:
            raise ConfigError(
                f'--{name.replace("_", "-")} must be from {low:g} to {high:g}, got {value}'
            )


def scaled_box(box: Box | None, source: ImageSource) -> Box | None:
    """Return the first box in pixels of the frames; ConfigError if they cannot show such a one."""
    if box is None:
        return None
    scaled = box.scaled(source.scale)
    try:
        check_start_box(scaled, source.size)
    except InputError as error:
        raise ConfigError(f'the first box does not fit the frames: {error}') from error
    return scaled


@dataclass(frozen=True)
class Settings:
    """What a parameter file says that concerns a pipeline."""

    config: PipelineConfig = field(default_factory=PipelineConfig)
    start: StartConfig = field(default_factory=StartConfig)
    bank: BankConfig = field(default_factory=BankConfig)


def read_parameter_file(path: Path, settings: Settings | None = None) -> Settings:
    """
    Return what a ROS parameter file says, as the nodes read it.

    Sections of other nodes, and parameters that only nodes have, are left out.

    :param settings: what holds where the file says nothing; the defaults if None.
    :raises ConfigError: if it cannot be read, says nothing to these nodes, or a stage has no such
        parameter or value.
    """
    settings = settings or Settings()
    content = read_yaml(path, ConfigError)
    sections = [section for name, section in sections_of(content) if name in _SECTIONS]
    if not sections:
        raise ConfigError(
            f'{path} sets no parameters: it must hold a node such as /** or gait_pipeline, in it '
            'ros__parameters, and in that the parameters'
        )
    for section in sections:
        given = _flat(section)
        for parameter, meant in misnamed(given, _names(settings.config)).items():
            hint = f': did you mean {meant}?' if meant else ', see docs/parameters.md'
            raise ConfigError(f'{path}: there is no parameter {parameter}{hint}')
        for parameter, value in given.items():
            try:
                settings = _changed(settings, parameter, value)
            except GaitSegmentationError as error:
                raise ConfigError(f'{path}: {error}') from error
    return settings


def _names(config: PipelineConfig) -> list[str]:
    """Return the names of all parameters that the nodes have."""
    groups = [(stage, type(values)) for stage, values in stages_of(config).items()]
    groups += [('', kind) for kind in (type(stages_of(config)[_UNNAMED]), *OF_NODES)]
    return [
        qualified(group, about.name) for group, kind in groups for about in parameters_of(kind)
    ]


def _flat(values: Any, prefix: str = '') -> dict[str, Any]:
    """Return nested sections as names with dots."""
    if not isinstance(values, dict):
        return {prefix.rstrip('.'): values}
    found: dict[str, Any] = {}
    for name, value in values.items():
        found |= _flat(value, f'{prefix}{name}.')
    return found


def _changed(settings: Settings, name: str, value: Any) -> Settings:
    for group in ('start', 'bank'):
        if name in (about.name for about in parameters_of(getattr(settings, group))):
            return replaced(settings, group, name, value)
    given, _, parameter = name.rpartition('.')
    stage, stages = given or _UNNAMED, stages_of(settings.config)
    if stage in stages and parameter in (about.name for about in parameters_of(stages[stage])):
        config = replaced(settings.config, stage, parameter, value)
        return replace(settings, config=config)
    return settings
