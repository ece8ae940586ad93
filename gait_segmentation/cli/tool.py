# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What commands share: errors in one line, Ctrl-C without a traceback, places for outputs."""

from __future__ import annotations

import argparse
import io
import os
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from gait_segmentation import MOST_PIXELS
from gait_segmentation.errors import (
    EXTRAS,
    ConfigError,
    GaitSegmentationError,
    InputError,
    not_installed,
)
from gait_segmentation.files import problem_of, shared_file
from gait_segmentation.geometry import Box, check_start_box

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
    """
    Return the parameter file of a preset, for :func:`read_parameter_file` and for nodes.

    :raises ConfigError: if it is not installed.
    """
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


def add_reading_options(parser: argparse.ArgumentParser, rate: str) -> None:
    """
    Add the options that say what of an input is read, and how.

    :param rate: what the input's own rate is.
    """
    add = parser.add_argument
    add('--topic', default='', help='topic of the images, if a bag has several')
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
    """
    Refuse options with numbers that are not allowed.

    :param ranges: the least and the largest by the name of the option.
    :raises ConfigError: at the first such option, with what is allowed.
    """
    for name, (low, high) in ranges.items():
        value = getattr(options, name)
        # Written so that what is no number is refused.
        if not low <= value <= high:
            raise ConfigError(
                f'--{name.replace("_", "-")} must be from {low:g} to {high:g}, got {value}'
            )


def scaled_box(box: Box | None, source: ImageSource) -> Box | None:
    """
    Return the first box in the pixels of the frames, None where people are to be found.

    :raises ConfigError: if it lies outside of the frames or is far larger.
    """
    if box is None:
        return None
    scaled = box.scaled(source.scale)
    try:
        check_start_box(scaled, source.size)
    except InputError as error:
        raise ConfigError(f'the first box does not fit the frames: {error}') from error
    return scaled
