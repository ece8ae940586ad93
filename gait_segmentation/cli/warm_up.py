# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The command ``gait_warm_up``: compile the kernels before a node has to."""

from __future__ import annotations

import argparse
import contextlib
import dataclasses
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

from gait_segmentation.cli.replaying.settings import Settings, read_parameter_file
from gait_segmentation.cli.tool import run_tool
from gait_segmentation.kernels import Kernels
from gait_segmentation.pipeline import PipelineConfig
from gait_segmentation.warm_up import open_bank, warm_up

__all__ = ['main']

_REFRESH_S = 0.2

_DESCRIPTION = """
Compile all kernels, a minute or two once after each installation, so that no
node has to when it starts.  They are kept in Numba's cache: run this as the
user who will run the nodes, with the same NUMBA_CACHE_DIR if that is set.
"""

_EPILOG = """
exit code: 0, also if there is nothing to do; 2 after an error; 130 if
interrupted: what was compiled until then is kept

examples:
  ros2 run gait_segmentation gait_warm_up
  gait_warm_up --params mine.yaml
"""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog='gait_warm_up',
        description=_DESCRIPTION,
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        '--params',
        type=Path,
        metavar='FILE',
        help='parameters of the nodes: some choices, such as segmentation.prior, have kernels of '
        'their own',
    )
    return parser


def _run(options: argparse.Namespace) -> None:
    settings = Settings(PipelineConfig())
    if options.params is not None:
        settings = read_parameter_file(options.params, settings)
    config = settings.config
    # Kernels of several people are none that one person could do without.
    people = dataclasses.replace(config.people, max_people=max(2, config.people.max_people))
    before = Kernels.now().compiled
    with _progress():
        warm_up(dataclasses.replace(config, people=people), open_bank(settings.bank))
    now = Kernels.now()
    if now.compiled > before:
        print(f'kernels compiled, and kept for the next start: {now.compiled - before}')
    else:
        print(f"nothing to do: all {now.ready} kernels are in Numba's cache")


@contextlib.contextmanager
def _progress() -> Iterator[None]:
    """Show how many kernels are ready."""
    if not sys.stderr.isatty():
        yield
        return
    over = threading.Event()

    def show() -> None:
        while not over.wait(_REFRESH_S):
            kernels = Kernels.now()
            line = f'\rcompiling: {kernels.ready} of {kernels.known} kernels '
            print(line, end='', file=sys.stderr, flush=True)

    shown = threading.Thread(target=show, daemon=True)
    shown.start()
    try:
        yield
    finally:
        over.set()
        shown.join()
        print(file=sys.stderr)


def main(arguments: list[str] | None = None) -> int:
    """Run the command and return its exit code."""
    options = _parser().parse_args(arguments)
    return run_tool('gait_warm_up', lambda: _run(options))


if __name__ == '__main__':
    sys.exit(main())
