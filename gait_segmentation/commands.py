# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The commands.

What they need takes a while to import, and Ctrl-C is to end them quietly from the beginning: this
imports nothing else before it has seen to that.
"""

from __future__ import annotations

import os
import signal
import sys
from functools import partial
from importlib import import_module
from types import FrameType

from gait_segmentation.errors import EXTRAS, not_installed

_TOOLS = ('replay', 'warm_up')
_NODES = ('detector', 'localizer', 'matcher', 'pipeline', 'segmenter', 'tracker')
__all__ = [*_TOOLS, *_NODES]

_PACKAGE = 'gait_segmentation'
ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
"""The signals that ask a process to end."""

FAILED, INTERRUPTED = 2, 130
"""Exit codes of commands."""

_LOST_IN = ('_raw_object_cache', '__del__')
"""Beginnings of names of functions that the compiler (llvmlite) and the interpreter call back."""
_AGAIN_S = 0.02

_OF_ROS = ('ament_', 'rcl', 'rosgraph_'), ('_interfaces', '_msgs', '_srvs')
"""Beginnings and ends of names of modules that come with ROS 2, and not from requirements."""


def main() -> int:
    """Run the command that is the first argument."""
    name = sys.argv.pop(1) if len(sys.argv) > 1 else ''
    if name not in __all__:
        print(f'{_PACKAGE}: error: the commands are {", ".join(sorted(__all__))}', file=sys.stderr)
        return FAILED
    sys.argv[0] = f'gait_{name}'
    return _run(name)


def run_tool(name: str, package: str) -> int:
    """
    Run a command that says so and returns 130 when it is interrupted.

    :param package: the one whose ``cli`` has it.
    """
    return _run(name, f'{package}.cli.{name}')


def _run(name: str, tool: str | None = None) -> int:
    command = f'gait_{name}'
    if name in _TOOLS:
        tool = f'{_PACKAGE}.cli.{name}'
    # Those ignored, as of what a shell runs in the background, stay so.
    heeded = [each for each in ENDING if signal.getsignal(each) != signal.SIG_IGN]
    text, code = (f'{command}: interrupted\n', INTERRUPTED) if tool else ('', 0)

    def end(number: int, frame: object) -> None:
        # At once: nothing is there yet to be closed, and imports may swallow an exception.
        os.write(2, text.encode())
        os._exit(code)

    def heed(handler: object) -> None:
        for each in heeded:
            signal.signal(each, handler)  # type: ignore[arg-type]

    heed(end)
    try:
        # OpenCV crashes on names that are not text.
        given = ' '.join(sys.argv[1:])
        if given.encode(errors='ignore').decode() != given:
            shown = os.fsencode(given).decode(errors='replace')
            print(f'{command}: error: {shown} is not UTF-8: rename it', file=sys.stderr)
            return FAILED
        if tool:
            module = import_module(tool)
            heed(_interrupt)
        else:
            # Not if there is anything to be said of the command line: ``--`` ends ROS's own.
            if sys.argv[1:2] in ([], ['--ros-args']) and '--' not in sys.argv:
                import_module(f'{_PACKAGE}.ros.participant').take_part_early()
            # Sets handlers of its own.
            module = import_module(f'{_PACKAGE}.nodes.{name}_node')
        return int(module.main())
    except ModuleNotFoundError as error:
        print(f'{command}: error: {_remedy(error)}', file=sys.stderr)
        return FAILED
    except SystemError as error:
        # What becomes of an interrupt in a kernel that is just being called.
        if not isinstance(error.__cause__, KeyboardInterrupt):
            raise
        os.write(2, text.encode())
        return code
    finally:
        # What is left is the interpreter's own clean-up, of which nobody wants a traceback.
        heed(signal.SIG_IGN)


def _interrupt(number: int, frame: FrameType | None) -> None:
    """Raise KeyboardInterrupt, later if it comes where it would be lost but for a traceback."""
    inside = frame
    while inside is not None:
        if inside.f_code.co_name.startswith(_LOST_IN):
            # Only now: to import it takes time.
            from threading import Timer, get_ident

            again = Timer(_AGAIN_S, signal.pthread_kill, (get_ident(), number))
            again.daemon = True
            again.start()
            return
        inside = inside.f_back
    raise KeyboardInterrupt


def _remedy(error: ModuleNotFoundError) -> str:
    """
    Say what to do where ROS or what the tools need is not there.

    :raises ModuleNotFoundError: if it is something else that is missing.
    """
    missing = (error.name or '').partition('.')[0]
    if missing.startswith(_OF_ROS[0]) or missing.endswith(_OF_ROS[1]):
        return (
            f'there is no ROS 2 for this Python (no module {error.name}): source its setup, such '
            "as /opt/ros/jazzy/setup.bash, or pip install '.[ros]'"
        )
    if missing in EXTRAS:
        return not_installed(missing)
    raise error


replay = partial(_run, 'replay')
warm_up = partial(_run, 'warm_up')
tracker = partial(_run, 'tracker')
matcher = partial(_run, 'matcher')
detector = partial(_run, 'detector')
localizer = partial(_run, 'localizer')
segmenter = partial(_run, 'segmenter')
pipeline = partial(_run, 'pipeline')
