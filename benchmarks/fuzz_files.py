#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Damaged and hostile files given to all commands.

Small valid inputs of every kind (films, folders, bags, sequences, parameter files, banks,
vocabularies, silhouettes) are changed by chance: cut off, flipped, spliced, with huge numbers,
replaced by a FIFO, a device, a link in a circle ...; some commands find a full disk, and some are
told to write to what they read.  Each must end in time with an exit code that it documents and,
if that is an error, a line that says so; without a traceback, with its inputs as they were, and
without hidden files left.
"""

from __future__ import annotations

import atexit
import hashlib
import importlib
import os
import re
import resource
import shutil
import signal
import stat
import subprocess
import sys
import tempfile
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from random import Random

from hypothesis import strategies as st

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.fuzzing import fuzz
from benchmarks.spoilt_files import KINDS, MUTATIONS, PLACES, command_of, make_inputs, mutate
from gait_segmentation.cli.tool import run_tool

MODULES = {
    'gait_replay': 'gait_segmentation.cli.replay',
    'gait_evaluate': 'gait_tools.cli.evaluate',
    'gait_bank': 'gait_tools.cli.bank',
    'gait_demo': 'gait_tools.cli.demo',
    'gait_source': 'gait_segmentation.nodes.source_node',
}
CODES = {'gait_replay': {0, 1, 2}, 'gait_source': {0, 1, 2}}
"""Exit codes that are documented; 0 and 2 of the others."""

TRACES = ('Traceback (most recent call last)', 'Exception ignored', 'None:', 'Fatal Python error')
PROCESSES, FULL_DISKS, SAME = 0.02, 0.1, 0.05
"""Shares of the cases that are processes of their own, with a full disk, and over the input."""

MEMORY = 12 << 30
"""Bytes of addresses, so that a mistake does not take the whole machine."""


@cache
def good_inputs() -> Path:
    """Return the folder of valid inputs, made once a process."""
    folder = Path(tempfile.mkdtemp(prefix='fuzz_files'))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    make_inputs(folder)
    return folder


def prepare() -> None:
    """Load everything once: to start a command takes seconds."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    for module in MODULES.values():
        importlib.import_module(module)
    good_inputs()


def state_of(folder: Path) -> dict[str, str]:
    """Return what is in a folder: names with their modes and a digest of regular files."""
    found = {}
    for path in sorted(folder.rglob('*')):
        about = path.lstat()
        found[os.fsencode(path).hex()] = f'{about.st_mode} {about.st_size}'
        if stat.S_ISREG(about.st_mode):
            found[os.fsencode(path).hex()] += hashlib.sha256(path.read_bytes()).hexdigest()
    return found


@contextmanager
def surroundings(folder: Path, room: int | None, said: int) -> Iterator[None]:
    """Be in a folder, with files of at most ``room`` bytes, and with all output in a file."""
    # Of the process, since libraries in C write there, too.
    before = [os.dup(number) for number in (1, 2)]
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)
    os.chdir(folder)
    sys.stdout.flush()
    for number in (1, 2):
        os.dup2(said, number)
    if room is not None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (room, limit[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)
        sys.stdout.flush()
        sys.stderr.flush()
        for number, old in zip((1, 2), before, strict=True):
            os.dup2(old, number)
            os.close(old)
        for each in (signal.SIGINT, signal.SIGTERM):
            signal.signal(each, signal.SIG_DFL)
        os.chdir('/')


def ended(command: list[str], folder: Path, room: int | None, alone: bool) -> tuple[int, str]:
    """Run a command, in a process of its own or in this; return its exit code and all it said."""
    name, *arguments = command
    with tempfile.TemporaryFile() as said:
        with surroundings(folder, room, said.fileno()):
            try:
                if alone:
                    program = f'import sys; from {MODULES[name]} import main; sys.exit(main())'
                    words = [sys.executable, '-c', program, *arguments]
                    path = str(Path(__file__).resolve().parents[1])
                    code = subprocess.call(words, env={**os.environ, 'PYTHONPATH': path})
                else:
                    code = sys.modules[MODULES[name]].main(arguments)
            except SystemExit as end:
                code = end.code if isinstance(end.code, int) else 1
            except BaseException:
                traceback.print_exc()
                code = -1
        said.seek(0)
        return code, said.read().decode(errors='replace')


def play(data: st.DataObject) -> None:
    """Try a case."""
    # Not drawn bit by bit: what is drawn depends on the inputs, which differ from time to time.
    rng, good = Random(data.draw(st.integers(0, 2**32 - 1))), good_inputs()
    kind, how = rng.choice(KINDS), rng.choice(MUTATIONS)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as scratch:
        folder = Path(scratch)
        given = folder / 'given' / kind
        given.parent.mkdir()
        (shutil.copytree if (good / kind).is_dir() else shutil.copy)(good / kind, given)
        given = mutate(given, how, rng).relative_to(folder)
        command = command_of(kind, rng, str(given), good)
        if rng.random() < SAME:
            how = 'over the input'
            places = (*PLACES.values(), 'eval', 'demo', 'out')
            command = [str(given) if word in places else word for word in command]
        room = rng.choice([20_000, 1_000_000]) if rng.random() < FULL_DISKS else None
        before, whole = state_of(folder / 'given'), state_of(good)
        code, said = ended(command, folder, room, rng.random() < PROCESSES)
        wrong = [f'says {trace!r}' for trace in TRACES if trace in said]
        if code not in CODES.get(command[0], {0, 2}):
            wrong.append(f'exit code {code}')
        if code == 2 and f'{command[0]}: error: ' not in said:
            wrong.append('no line says what is wrong')
        if state_of(folder / 'given') != before or state_of(good) != whole:
            wrong.append('an input was changed')
        wrong += [
            f'{path.relative_to(folder)} is left behind'
            for path in folder.rglob('.*')
            if re.search(r'\.(part|lock)', path.name) and 'given' not in path.parts
        ]
    assert not wrong, f'{kind}, {how}: {" ".join(command)}\n{"; ".join(wrong)}\n{said}'


def main() -> int:
    return fuzz(play, prepare, __doc__ or '')


if __name__ == '__main__':
    sys.exit(run_tool('fuzz_files.py', main))
