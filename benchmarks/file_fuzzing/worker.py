# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Running commands in one process that lives long: to start one takes seconds."""

from __future__ import annotations

import importlib
import os
import resource
import signal
import sys
import tempfile
import traceback
from multiprocessing.connection import Connection
from pathlib import Path
from typing import NamedTuple

__all__ = ['Outcome', 'serve']

_MODULES = {
    'gait_replay': 'gait_segmentation.cli.replay',
    'gait_evaluate': 'gait_segmentation.cli.evaluate',
    'gait_bank': 'gait_segmentation.cli.bank',
    'gait_demo': 'gait_segmentation.cli.demo',
    'gait_source': 'gait_segmentation.nodes.source_node',
}
_MEMORY = 12 << 30
"""Bytes of addresses, so that a mistake does not take the whole machine."""


class Outcome(NamedTuple):
    """How a command ended; ``code`` is None if an exception came out or it never ended."""

    code: int | None
    said: str


def serve(connection: Connection) -> None:
    """Run commands that are sent until None comes."""
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
    mains = {name: importlib.import_module(module).main for name, module in _MODULES.items()}
    connection.send('ready')
    while (asked := connection.recv()) is not None:
        folder, command, room = asked
        connection.send(_run(mains[command[0]], folder, command[1:], room))


def _run(main: object, folder: Path, arguments: list[str], room: int | None) -> Outcome:
    os.chdir(folder)
    sys.stdout.flush()
    with tempfile.TemporaryFile() as said:
        # Of the process, since libraries in C write there, too.
        before = [os.dup(number) for number in (1, 2)]
        for number in (1, 2):
            os.dup2(said.fileno(), number)
        limit = resource.getrlimit(resource.RLIMIT_FSIZE)
        if room is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (room, limit[1]))
        code: int | None = None
        try:
            code = main(arguments)  # type: ignore[operator]
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else 1
        except BaseException:
            traceback.print_exc()
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, limit)
            sys.stdout.flush()
            sys.stderr.flush()
            for number, old in zip((1, 2), before, strict=True):
                os.dup2(old, number)
                os.close(old)
            for number in (signal.SIGINT, signal.SIGTERM):
                signal.signal(number, signal.SIG_DFL)
        said.seek(0)
        return Outcome(code, said.read().decode(errors='replace'))
