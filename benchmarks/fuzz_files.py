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
without hidden files left.  Usage::

    python benchmarks/fuzz_files.py [--cases N] [--seed S] [--minutes M] [--only CASE] [--keep DIR]

A case is made from the seed and its number alone, so that ``--only`` repeats it.  Most run in one
process that lives long, some as processes of their own.  Ends with 1 if anything was found.
"""

from __future__ import annotations

import argparse
import hashlib
import multiprocessing
import os
import random
import re
import shutil
import stat
import subprocess
import sys
import tempfile
import time
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tqdm import tqdm

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from file_fuzzing.mutations import MUTATIONS, mutate
from file_fuzzing.valid_inputs import KINDS, command_of, make_inputs
from file_fuzzing.worker import Outcome, serve

from gait_segmentation.cli.tool import run_tool

ROOT = Path(__file__).resolve().parents[1]
START_S, CASE_S, END_S = 900.0, 30.0, 2.0
CODES = {'gait_replay': {0, 1, 2}, 'gait_source': {0, 1, 2}}
"""Exit codes that are documented; 0 and 2 of the others."""

TRACES = ('Traceback (most recent call last)', 'Exception ignored', 'None:', 'Fatal Python error')
PROCESSES = 0.02
"""Share of the cases that are processes of their own."""

FULL_DISKS, SAME = 0.1, 0.05
"""Shares of the cases with a full disk, and with an output over the input."""


@dataclass(frozen=True)
class Case:
    """A command line to be run in a folder; ``room`` is how large files may become."""

    kind: str
    mutation: str
    command: list[str]
    room: int | None
    alone: bool


def make_case(number: int, seed: int, good: Path, folder: Path) -> Case:
    """Make a case in an empty folder; the input is below ``given``."""
    rng = random.Random(f'{seed} {number}')
    kind, mutation = rng.choice(KINDS), rng.choice(MUTATIONS)
    given = folder / 'given' / kind
    given.parent.mkdir()
    source = good / kind
    if source.is_dir():
        shutil.copytree(source, given)
    else:
        shutil.copy(source, given)
    given = mutate(given, mutation, rng)
    command = command_of(kind, rng, str(given.relative_to(folder)), good)
    if rng.random() < SAME:
        mutation = 'over the input'
        command = [command[1] if word in _PLACES else word for word in command]
    room = rng.choice([20_000, 1_000_000]) if rng.random() < FULL_DISKS else None
    return Case(kind, mutation, command, room, rng.random() < PROCESSES)


_PLACES = ('masks', 'overlay.mp4', 'table.csv', 'gait', 'stamps.txt', 'eval', 'demo', 'a.json')


def state_of(folder: Path) -> dict[str, str]:
    """Return what is in a folder: names with their modes and a digest of regular files."""
    found = {}
    for path in sorted(folder.rglob('*')):
        about = path.lstat()
        found[os.fsencode(path).hex()] = f'{about.st_mode} {about.st_size}'
        if stat.S_ISREG(about.st_mode):
            found[os.fsencode(path).hex()] += hashlib.sha256(path.read_bytes()).hexdigest()
    return found


def complaints(case: Case, outcome: Outcome, left: list[str], changed: bool) -> list[str]:
    """Return what is wrong with how a command ended."""
    name = case.command[0]
    found = []
    if outcome.code not in CODES.get(name, {0, 2}):
        found.append(f'exit code {outcome.code}')
    found += [f'says {trace!r}' for trace in TRACES if trace in outcome.said]
    if outcome.code == 2 and f'{name}: error: ' not in outcome.said:
        found.append('no line says what is wrong')
    if changed:
        found.append('an input was changed')
    if left:
        found.append(f'left behind: {", ".join(left)}')
    return found


class Worker:
    """The process that runs the commands; started anew if one does not end."""

    def __init__(self) -> None:
        context = multiprocessing.get_context('spawn')
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=serve, args=(theirs,), daemon=True)
        self._process.start()
        theirs.close()
        self._limit_s = START_S
        if not self._pipe.poll(START_S) or self._pipe.recv() != 'ready':
            raise RuntimeError('the worker did not start')

    def run(self, case: Case, folder: Path) -> Outcome:
        """Run a command; the first may have kernels to compile."""
        try:
            self._pipe.send((folder, case.command, case.room))
            if self._pipe.poll(self._limit_s):
                self._limit_s = CASE_S
                outcome: Outcome = self._pipe.recv()
                return outcome
            said = f'nothing within {self._limit_s:g} s'
        except (EOFError, OSError):
            self._process.join()
            said = f'the process died: {self._process.exitcode}'
        self.close()
        self.__init__()  # type: ignore[misc]
        return Outcome(None, said)

    def close(self) -> None:
        """End the process, if need be by force."""
        with suppress(OSError):
            self._pipe.send(None)
            self._process.join(END_S)
        self._process.kill()
        self._process.join()


def run_alone(case: Case, folder: Path) -> Outcome:
    """Run a command as a process of its own."""
    name = case.command[0].removeprefix('gait_')
    program = f'import sys; from gait_segmentation import commands; sys.exit(commands.{name}())'
    environment = {**os.environ, 'PYTHONPATH': str(ROOT)}
    try:
        done = subprocess.run(
            [sys.executable, '-c', program, *case.command[1:]],
            cwd=folder,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            timeout=START_S,
        )
    except subprocess.TimeoutExpired:
        return Outcome(None, f'nothing within {START_S:g} s')
    return Outcome(done.returncode, done.stdout.decode(errors='replace'))


def try_case(case: Case, worker: Worker, folder: Path) -> tuple[Outcome, list[str]]:
    """Run a case and return how it ended and what is wrong with that."""
    before = state_of(folder / 'given')
    outcome = run_alone(case, folder) if case.alone else worker.run(case, folder)
    hidden = [
        str(path.relative_to(folder))
        for path in folder.rglob('.*')
        if re.search(r'\.(part|lock)', path.name) and 'given' not in path.parts
    ]
    changed = state_of(folder / 'given') != before
    return outcome, complaints(case, outcome, hidden, changed)


def arguments() -> argparse.Namespace:
    made = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    made.add_argument('--cases', type=int, default=1000, metavar='N', help='(%(default)s)')
    made.add_argument('--seed', type=int, help='(by chance)')
    made.add_argument('--minutes', type=float, default=60.0, metavar='M', help='(%(default)s)')
    made.add_argument('--only', type=int, metavar='CASE', help='one case, with all it says')
    made.add_argument('--keep', type=Path, metavar='DIR', help='keep the folders of what is found')
    return made.parse_args()


def main() -> int:
    options = arguments()
    seed = options.seed if options.seed is not None else random.SystemRandom().randrange(10**6)
    print(f'seed {seed}')
    numbers = range(options.cases) if options.only is None else [options.only]
    end = time.monotonic() + 60 * options.minutes
    kinds: Counter[str] = Counter()
    mutations: Counter[str] = Counter()
    codes: Counter[Any] = Counter()
    found = 0
    with tempfile.TemporaryDirectory(prefix='fuzz_files') as scratch:
        good = Path(scratch) / 'good'
        good.mkdir()
        make_inputs(good)
        whole = state_of(good)
        worker = Worker()
        for number in tqdm(numbers, unit='case', disable=None):
            if time.monotonic() > end:
                break
            folder = Path(scratch) / f'{number}'
            folder.mkdir()
            case = make_case(number, seed, good, folder)
            outcome, wrong = try_case(case, worker, folder)
            if state_of(good) != whole:
                raise RuntimeError(f'case {number} has changed an input beside its own')
            kinds[case.kind] += 1
            mutations[case.mutation] += 1
            codes[outcome.code] += 1
            if wrong or options.only is not None:
                found += bool(wrong)
                about = f'{case.kind}, {case.mutation}, room {case.room}, alone {case.alone}'
                tqdm.write(f'case {number} ({about}): {"; ".join(wrong) or "nothing wrong"}')
                tqdm.write(f'    {" ".join(case.command)}')
                lines = outcome.said.splitlines()[-4 if options.only is None else 0 :]
                tqdm.write(''.join(f'    | {line}\n' for line in lines))
                if options.keep is not None:
                    shutil.move(folder, options.keep / f'{number}')
            shutil.rmtree(folder, ignore_errors=True)
        worker.close()
    for name, counts in (('input', kinds), ('change', mutations), ('exit code', codes)):
        print(f'{name}: ' + ', '.join(f'{each} {count}' for each, count in counts.most_common()))
    print(f'{sum(kinds.values())} cases with seed {seed}: {found} with something wrong')
    return int(found > 0)


if __name__ == '__main__':
    sys.exit(run_tool('fuzz_files.py', main))
