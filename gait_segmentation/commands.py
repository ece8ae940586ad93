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
from types import FrameType, ModuleType

from gait_segmentation.errors import EXTRAS, not_installed

__all__ = [
    'demo',
    'localizer',
    'matcher',
    'pipeline',
    'replay',
    'segmenter',
    'source',
    'tracker',
    'warm_up',
]

_PACKAGE = 'gait_segmentation'
_SIGNALS = (signal.SIGINT, signal.SIGTERM)
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
        print(f'{_PACKAGE}: error: the commands are {", ".join(__all__)}', file=sys.stderr)
        return FAILED
    sys.argv[0] = f'gait_{name}'
    return int(globals()[name]())


def run_tool(name: str, package: str = _PACKAGE) -> int:
    """
    Run a command that says so and returns 130 when it is interrupted.

    :param package: the one whose ``cli`` has it.
    """
    if not _arguments_are_text(f'gait_{name}'):
        return FAILED
    before = {number: signal.getsignal(number) for number in _SIGNALS}
    text = f'gait_{name}: interrupted\n'
    try:
        module = _imported(f'{package}.cli.{name}', text, INTERRUPTED)
        for number, handler in before.items():
            default = handler is signal.default_int_handler
            signal.signal(number, _interrupt if default else handler)
        return int(module.main())
    except ModuleNotFoundError as error:
        return _without(f'gait_{name}', error)
    except SystemError as error:
        # What becomes of an interrupt in a kernel that is just being called.
        if not isinstance(error.__cause__, KeyboardInterrupt):
            raise
        os.write(2, text.encode())
        return INTERRUPTED
    finally:
        # What is left is the interpreter's own clean-up, of which nobody wants a traceback.
        for number in _SIGNALS:
            signal.signal(number, signal.SIG_IGN)


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


def _run_node(name: str) -> int:
    """Run a node, for which to be interrupted is the usual end; it sets handlers of its own."""
    if not _arguments_are_text(f'gait_{name}'):
        return FAILED
    try:
        # Not if there is anything to be said of the command line first: ``--`` ends ROS's own.
        if sys.argv[1:2] in ([], ['--ros-args']) and '--' not in sys.argv:
            _imported('gait_segmentation.ros.participant', '', 0).take_part_early()
        return int(_imported(f'gait_segmentation.nodes.{name}_node', '', 0).main())
    except ModuleNotFoundError as error:
        return _without(f'gait_{name}', error)


def _without(name: str, error: ModuleNotFoundError) -> int:
    """
    Say what to do where ROS or what the tools need is not there.

    :raises ModuleNotFoundError: if it is something else that is missing.
    """
    missing = (error.name or '').partition('.')[0]
    if missing.startswith(_OF_ROS[0]) or missing.endswith(_OF_ROS[1]):
        what = (
            f'there is no ROS 2 for this Python (no module {error.name}): source its setup, such '
            "as /opt/ros/jazzy/setup.bash, or pip install '.[ros]'"
        )
    elif missing in EXTRAS:
        what = not_installed(missing)
    else:
        raise error
    print(f'{name}: error: {what}', file=sys.stderr)
    return FAILED


def _arguments_are_text(name: str) -> bool:
    """Return whether the command line is UTF-8, and say if not: OpenCV crashes on such names."""
    for argument in sys.argv[1:]:
        try:
            argument.encode()
        except UnicodeEncodeError:
            shown = os.fsencode(argument).decode('utf-8', 'replace')
            print(f'{name}: error: {shown} is not UTF-8: rename it', file=sys.stderr)
            return False
    return True


def _imported(module: str, text: str, code: int) -> ModuleType:
    """Import a module; a signal meanwhile, or later, ends the process with a text and a code."""

    def end(number: int, frame: object) -> None:
        # At once: nothing is there yet to be closed, and imports may swallow an exception.
        os.write(2, text.encode())
        os._exit(code)

    for number in _SIGNALS:
        # Those ignored, as of what a shell runs in the background, stay so.
        if signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, end)
    return import_module(module)


demo = partial(run_tool, 'demo')
replay = partial(run_tool, 'replay')
warm_up = partial(run_tool, 'warm_up')
tracker = partial(_run_node, 'tracker')
matcher = partial(_run_node, 'matcher')
localizer = partial(_run_node, 'localizer')
segmenter = partial(_run_node, 'segmenter')
pipeline = partial(_run_node, 'pipeline')
source = partial(_run_node, 'source')
