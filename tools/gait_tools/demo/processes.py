# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The commands of gait_segmentation as child processes that end with what has begun them."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path

from gait_segmentation.errors import GaitSegmentationError

_GRACE_S = 5.0
_LAST_LINES = 15


class ProcessError(GaitSegmentationError):
    """A process that should run has ended, or ended with an error."""


class ProcessGroup(contextlib.AbstractContextManager['ProcessGroup']):
    """
    Named processes whose output goes to log files.

    As a context manager it stops all of them at the end, whatever happened: first with SIGINT,
    those that are still there after 5 seconds with SIGKILL.
    """

    def __init__(self, environment: Mapping[str, str], logs: Path) -> None:
        """
        Begin without processes.

        :param environment: of the processes.
        :param logs: folder for ``NAME.log``.
        """
        logs.mkdir(parents=True, exist_ok=True)
        self._environment, self._logs = environment, logs
        self._children: dict[str, subprocess.Popen[bytes]] = {}

    def __exit__(self, *_: object) -> None:
        """Stop all processes."""
        self.stop()

    def start(self, name: str, *arguments: str) -> None:
        """Start ``python -m gait_segmentation arguments``."""
        with open(self._logs / f'{name}.log', 'wb') as output:
            self._children[name] = subprocess.Popen(
                [sys.executable, '-m', 'gait_segmentation', *arguments],
                env={**self._environment, 'PYTHONPATH': os.pathsep.join(sys.path)},
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
            )

    def check_running(self, *names: str) -> None:
        """
        Make sure that these processes still run, and that no other has failed.

        :raises ProcessError: with the name and the last lines of one that does not.
        """
        for name, process in self._children.items():
            code = process.poll()
            if code or (code is not None and name in names):
                how = f'was killed by signal {-code}' if code < 0 else f'ended with code {code}'
                raise ProcessError(f'{name} {how}\n{self.last_lines(name)}')

    def ended(self, name: str) -> bool:
        """Return whether a process has ended."""
        return self._children[name].poll() is not None

    def pid(self, name: str) -> int:
        """Return the number of a process."""
        return self._children[name].pid

    def last_lines(self, name: str, count: int = _LAST_LINES) -> str:
        """Return the end of a process's output, indented."""
        text = (self._logs / f'{name}.log').read_text(encoding='utf-8', errors='replace')
        return '\n'.join(f'    {line}' for line in text.splitlines()[-count:])

    def stop(self, *names: str) -> None:
        """Stop processes, all if none is named, and wait until they are gone."""
        children = [self._children[name] for name in names or self._children]
        for process in children:
            process.send_signal(signal.SIGINT)
        deadline = time.monotonic() + _GRACE_S
        for process in children:
            try:
                process.wait(max(deadline - time.monotonic(), 0.0))
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
