#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Plant faults in the package, one at a time, and tell which of them the tests find.

``faults.toml`` beside this file lists them: by file, a text that stands in it once and what takes
its place.  Each is one edit that changes a result which a user or a document relies on.  The tests
that are to find it are those named after the file, then all of its folder, unless the list names
others for the file; and those of what puts the stages together::

    make faults
    python tools/faults.py [--jobs 2] [--only TEXT] [--least 0.97]

Works on copies of the tree, so that neither its files nor its compiled kernels change.  Exit code
0: at least the share asked for is found; 1: it is not, and those that survived are listed; 2: a
fault does not fit the code any more, or tests fail without any.
"""

from __future__ import annotations

import argparse
import importlib
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
LIST = Path(__file__).with_name('faults.toml')
TOGETHER = ('test/test_pipeline.py', 'test/nodes/test_graph.py')
LIMIT_S = 300.0
"""A test that hangs has found its fault."""

_LEFT_OUT = ('.git', '.venv*', 'out', '.mypy_cache', '.ruff_cache', '.pytest_cache', '.hypothesis')


class Fault(NamedTuple):
    """An edit of a file, and the tests that are to find it, if they are named."""

    file: str
    old: str
    new: str
    tests: tuple[str, ...] = ()

    def suite(self) -> list[str]:
        """Return the tests to run, those of the file and of the folder first."""
        if self.tests:
            return [*self.tests, *TOGETHER]
        *folders, name = Path(self.file).with_suffix('').parts[1:]
        near = [Path('test', *folders, f'test_{name}.py')]
        near += [Path('test', *folders[:1])] if folders else []
        return [*(str(each) for each in near if (ROOT / each).exists()), *TOGETHER]


def read(path: Path, only: str) -> list[Fault]:
    """
    Return the faults of a list whose file or text has something in it.

    :raises ValueError: if one does not fit the code.
    """
    # Python 3.10 has it only where pytest brought it.
    toml = importlib.import_module('tomllib' if sys.version_info >= (3, 11) else 'tomli')
    listed = toml.loads(path.read_text(encoding='utf-8'))
    tests = listed.pop('tests')
    faults = [
        Fault(file, old, new, tuple(tests.get(file, ())))
        for file, edits in listed.items()
        for old, new in edits
    ]
    for fault in faults:
        count = (ROOT / fault.file).read_text(encoding='utf-8').count(fault.old)
        if count != 1 or fault.new == fault.old:
            raise ValueError(f'{fault.file} must have this once, has it {count}x: {fault.old!r}')
    return [fault for fault in faults if only in fault.file or only in fault.old]


@contextmanager
def copy_of(tree: Path, fault: Fault | None = None) -> Iterator[Path]:
    """Have a copy of a tree, with a fault; of a copy only what is written anew takes room."""
    with tempfile.TemporaryDirectory(prefix='faults_', ignore_cleanup_errors=True) as scratch:
        copy, left_out = Path(scratch, 'tree'), shutil.ignore_patterns(*_LEFT_OUT)
        # Either way files keep their times, and so the kernels compiled from them.
        how = shutil.copy2 if fault is None else os.link
        shutil.copytree(tree, copy, ignore=left_out, copy_function=how)
        if fault is not None:
            text = (copy / fault.file).read_text(encoding='utf-8')
            (copy / fault.file).unlink()
            (copy / fault.file).write_text(text.replace(fault.old, fault.new), encoding='utf-8')
        yield copy


def passes(tree: Path, tests: list[str], limit_s: float | None = None) -> bool:
    """Return whether tests pass in a tree; in that kernels are compiled, too."""
    env = {key: value for key, value in os.environ.items() if key != 'NUMBA_CACHE_DIR'}
    env['PYTHONPATH'] = f'{tree}{os.pathsep}{tree / "tools"}'
    command = [sys.executable, '-m', 'pytest', '-x', '-q', '-p', 'no:cacheprovider', *tests]
    try:
        done = subprocess.run(command, cwd=tree, env=env, capture_output=True, timeout=limit_s)
    except subprocess.TimeoutExpired:
        return False
    return done.returncode == 0


def is_found(fault: Fault, tree: Path) -> bool:
    """Plant a fault in a copy of a tree, and return whether a test fails."""
    with copy_of(tree, fault) as copy:
        return not passes(copy, fault.suite(), LIMIT_S)


def main() -> int:
    """Plant, count and say what survived."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument('--jobs', type=int, default=2, metavar='N', help='at a time (%(default)s)')
    parser.add_argument('--only', default='', metavar='TEXT', help='of files or edits with a text')
    parser.add_argument('--least', type=float, default=0.97, help='share to find (%(default)s)')
    options = parser.parse_args()
    survived = 0
    try:
        faults = read(LIST, options.only)
        with copy_of(ROOT) as tree, ThreadPoolExecutor(options.jobs) as threads:
            if faults and not passes(
                tree, sorted({test for fault in faults for test in fault.suite()})
            ):
                raise ValueError('tests fail without any fault, so that they would find all')
            found = threads.map(partial(is_found, tree=tree), faults)
            for number, (fault, is_seen) in enumerate(zip(faults, found, strict=True), 1):
                said = 'found' if is_seen else f'SURVIVED {fault.old!r} -> {fault.new!r}'
                print(f'{number}/{len(faults)} {fault.file}: {said}', flush=True)
                survived += not is_seen
    except ValueError as error:
        print(f'faults.py: error: {error}', file=sys.stderr)
        return 2
    share = 1 - survived / max(len(faults), 1)
    print(f'{len(faults) - survived} of {len(faults)} found ({share:.1%})')
    return 0 if share >= options.least else 1


if __name__ == '__main__':
    sys.exit(main())
