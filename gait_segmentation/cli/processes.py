# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Child processes that never outlive their parent."""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Mapping
from functools import partial
from pathlib import Path

from gait_segmentation.commands import ENDING
from gait_segmentation.errors import GaitSegmentationError

__all__ = ['ProcessError', 'ProcessGroup']

_PR_SET_PDEATHSIG = 1
_GRACE_S = 5.0
_LAST_LINES = 15


class ProcessError(GaitSegmentationError):
    """A process that should run has ended, or ended with an error."""


class ProcessGroup(contextlib.AbstractContextManager['ProcessGroup']):
    """
    Named Python processes whose output goes to log files.

    As a context manager it stops all of them at the end, whatever happened: first with SIGINT,
    those that are still there after 5 seconds with SIGKILL.  If the parent ends without that the
    kernel kills them.
    """

    def __init__(self, environment: Mapping[str, str], logs: Path) -> None:
        """
        Begin without processes.

        :param environment: of the processes.
        :param logs: folder for ``NAME.log``.
        """
        self._environment = dict(environment)
        root = str(Path(__file__).resolve().parents[2])
        paths = [root, *filter(None, [self._environment.get('PYTHONPATH')])]
        self._environment['PYTHONPATH'] = os.pathsep.join(paths)
        self._logs = logs
        self._children: dict[str, subprocess.Popen[bytes]] = {}

    def __exit__(self, *_: object) -> None:
        """Stop all processes."""
        self.stop()

    def start(self, name: str, module: str, *arguments: str) -> None:
        """Start ``python -m module arguments``."""
        self._logs.mkdir(parents=True, exist_ok=True)
        # An interrupt between the two would leave a process that nobody stops.
        before = signal.pthread_sigmask(signal.SIG_BLOCK, ENDING)
        try:
            with open(self._logs / f'{name}.log', 'wb') as output:
                self._children[name] = subprocess.Popen(
                    [sys.executable, '-m', module, *arguments],
                    env=self._environment,
                    stdin=subprocess.DEVNULL,
                    stdout=output,
                    stderr=subprocess.STDOUT,
                    start_new_session=True,
                    preexec_fn=partial(_die_with_parent, before),
                )
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)

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
        log = self._logs / f'{name}.log'
        lines = log.read_text(encoding='utf-8', errors='replace').splitlines()[-count:]
        return '\n'.join(f'    {line}' for line in lines) or '    (no output)'

    def stop(self, *names: str) -> None:
        """Stop processes, all if none is named, and wait until they are gone."""
        children = [self._children[name] for name in names or self._children]
        for process in children:
            _signal(process, signal.SIGINT)
        deadline = time.monotonic() + _GRACE_S
        for process in children:
            try:
                process.wait(max(deadline - time.monotonic(), 0.0))
            except subprocess.TimeoutExpired:
                _signal(process, signal.SIGKILL)
                process.wait()


def _signal(process: subprocess.Popen[bytes], number: signal.Signals) -> None:
    if process.poll() is None:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, number)


def _die_with_parent(blocked: Iterable[int]) -> None:
    signal.pthread_sigmask(signal.SIG_SETMASK, blocked)
    if sys.platform == 'linux':
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
