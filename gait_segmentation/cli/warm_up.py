# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The command ``gait_warm_up``: compile the kernels before a node has to."""

from __future__ import annotations

import sys

# Whose imports are all modules with kernels that nodes call.
import gait_segmentation.pipeline  # noqa: F401
from gait_segmentation.cli.tool import command_parser, run_tool
from gait_segmentation.kernels import compile_kernels

_DESCRIPTION = """
Compile all kernels, for a minute or some, once after each installation,
so that no node has to when it starts.  They are kept in Numba's cache: run
this as the user who will run the nodes, with the same NUMBA_CACHE_DIR if that
is set.
"""

_NOTES = """
exit code: 0, also if there is nothing to do; 2 after an error; 130 if
interrupted: what was compiled until then is kept

example:
  ros2 run gait_segmentation gait_warm_up
"""


def _run() -> None:
    compiled = compile_kernels()
    if compiled:
        print(f'kernels compiled, and kept for the next start: {compiled}')
    else:
        print("nothing to do: all kernels are in Numba's cache")


def main(arguments: list[str] | None = None) -> int:
    """Run the command and return its exit code."""
    parser = command_parser('gait_warm_up', _DESCRIPTION, _NOTES)
    parser.parse_args(arguments)
    return run_tool('gait_warm_up', _run)


if __name__ == '__main__':
    sys.exit(main())
