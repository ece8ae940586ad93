#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Plant faults in the package, one at a time, and tell which of them the tests find.

``faults.toml`` beside this file lists them: by file, a text that stands in it once and what takes
its place.  Each is one edit that changes a result which a user or a document relies on.
``--random`` draws mechanical ones instead (see ``mutants.py``), others for each seed::

    make faults
    python tools/faults.py [--jobs 2] [--only TEXT] [--random 300 [--seed 1]] [--least 0.97]

All tests run once without a fault, which tells how long each takes and what it covers.  A fault
is then given to the test files that cover its line, those named after its file and of its folder
first, and is

* found if a test fails by an assertion that passes without the fault;
* survived if none fails;
* broke if they only fail by other exceptions, or do not even start: that nobody looks at a result
  is what such a fault tells, and of those that are drawn it is not counted;
* hung if they do not end.

Works on copies of the tree, so that neither its files nor its compiled kernels change.  Exit code
0: at least the share asked for is found; 1: it is not; 2: a fault does not fit the code any more,
or the tests cannot be run.
"""

from __future__ import annotations

import argparse
import ast
import contextlib
import importlib
import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).resolve().parents[1]
LIST = Path(__file__).with_name('faults.toml')
PACKAGE = 'gait_segmentation'
FOUND = 100
"""The exit code of tests of which one fails by an assertion."""

BUDGET_S = 60.0
"""So long the tests take at most that look for a fault, by the run without one."""

LIMIT_S = 5 * BUDGET_S
BROKEN = 30
"""After so many that fail otherwise no more is tried."""

_LEFT_OUT = ('.git', '.venv*', 'out', '.mypy_cache', '.ruff_cache', '.pytest_cache', '.hypothesis')
# It fails by any fault, for the list does not fit then.
_LEFT_OUT += ('test_faults.py',)
_ORDER, _SECONDS = 'FAULTS_ORDER', 'FAULTS_SECONDS'


class Fault(NamedTuple):
    """An edit of a file, and where in its text it begins."""

    file: str
    start: int
    old: str
    new: str

    def planted(self, text: str) -> str:
        """Return the text of the file with it."""
        return text[: self.start] + self.new + text[self.start + len(self.old) :]

    def shown(self, text: str) -> str:
        """Return its lines, with what it changes between brackets."""
        begin, end = text.rfind('\n', 0, self.start) + 1, self.start + len(self.old)
        rest = text[end:].partition('\n')[0]
        return ' '.join(f'{text[begin : self.start]}[{self.old} -> {self.new}]{rest}'.split())

    def line(self, text: str) -> int:
        """Return where it stands, from 1."""
        return text.count('\n', 0, self.start) + 1


def listed(path: Path = LIST) -> list[Fault]:
    """
    Return the faults of a list.

    :raises ValueError: if one does not fit the code.
    """
    # Python 3.10 has it only where pytest brought it.
    toml = importlib.import_module('tomllib' if sys.version_info >= (3, 11) else 'tomli')
    faults = []
    for file, edits in toml.loads(path.read_text(encoding='utf-8')).items():
        text = (ROOT / file).read_text(encoding='utf-8')
        for old, new in edits:
            if text.count(old) != 1 or new == old:
                raise ValueError(f'{file} must have this once, has it {text.count(old)}x: {old!r}')
            faults.append(Fault(file, text.index(old), old, new))
    return faults


class Suite(NamedTuple):
    """All tests that pass without a fault: how long each takes, and what their files cover."""

    seconds: dict[str, float]
    covers: dict[str, dict[int, set[str]]]

    @classmethod
    def of(cls, tree: Path, jobs: int) -> Suite:
        """
        Run all tests of a tree; in that kernels are compiled, too.

        :raises ValueError: if none pass.
        """
        took, data = tree.with_name('seconds.json'), tree.with_name('coverage')
        often = ('-n', f'{jobs}', '--dist', 'loadfile', f'--cov={PACKAGE}', '--cov-context=test')
        about = {_SECONDS: str(took), 'COVERAGE_FILE': str(data)}
        run(tree, [*often, '--cov-report=', 'test'], about)
        if not took.is_file() or not (seconds := json.loads(took.read_text(encoding='utf-8'))):
            raise ValueError('the tests cannot be run')
        measured = importlib.import_module('coverage').CoverageData(str(data))
        measured.read()
        covers = {}
        for name in measured.measured_files():
            lines = measured.contexts_by_lineno(name)
            covers[Path(name).relative_to(tree.resolve()).as_posix()] = {
                line: {context.rpartition('|')[0] for context in contexts if context}
                for line, contexts in lines.items()
            }
        return cls(seconds, covers)

    def order(self, fault: Fault, text: str) -> list[str]:
        """Return the tests that are to find a fault, the nearest first."""
        lines = statement(text, fault.line(text), fault.line(text) + fault.old.count('\n'))
        covers = self.covers.get(fault.file, {})
        # Not seen are kernels, processes, and what is done when the file is imported.
        covering = set().union(*(covers.get(line, ()) for line in lines))
        files = {file_of(test) for test in covering or self.seconds}
        takes: Counter[str] = Counter()
        for test, seconds in self.seconds.items():
            takes[file_of(test)] += seconds
        *folders, name = Path(fault.file).with_suffix('').parts[1:]

        def distance(test: str) -> tuple[int, float, str, bool, float]:
            file = file_of(test)
            near = Path(file).parts[1:-1][:1] == tuple(folders[:1])
            far = 0 if near and Path(file).stem == f'test_{name}' else 1 if near else 2
            return far, takes[file], file, test not in covering, self.seconds[test]

        left, order = BUDGET_S, []
        for test in sorted(self.seconds, key=distance):
            if file_of(test) in files and left > 0:
                left -= self.seconds[test]
                order.append(test)
        return order


def file_of(test: str) -> str:
    """Return the file of a test: others of it may share what the first one makes."""
    return test.partition('::')[0]


def statement(text: str, first: int, last: int) -> range:
    """Return the lines of the innermost statement at some lines, without what is in its body."""
    spans = [(first, last)]
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.stmt):
            body = getattr(node, 'body', None)
            end = max(node.lineno, body[0].lineno - 1) if body else node.end_lineno or 0
            if node.lineno <= first <= end:
                spans.append((node.lineno, max(last, end)))
    begin, end = max(spans[1:], default=spans[0])
    return range(begin, end + 1)


def run(tree: Path, arguments: list[str], about: dict[str, str], limit_s: float = 3600.0) -> int:
    """Run tests in a tree, and return how they end."""
    env = {key: value for key, value in os.environ.items() if key != 'NUMBA_CACHE_DIR'} | about
    env['PYTHONPATH'] = f'{tree}{os.pathsep}{tree / "tools"}'
    command = [sys.executable, '-m', 'pytest', '-q', '-p', 'no:cacheprovider', '-p', 'faults']
    with tree.with_name('said.txt').open('w', encoding='utf-8') as said:
        # Of its own session, so that no process of a test that hangs is left.
        tests = subprocess.Popen(
            [*command, *arguments],
            cwd=tree,
            env=env,
            stdout=said,
            stderr=said,
            start_new_session=True,
        )
        try:
            return tests.wait(limit_s)
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(tests.pid, signal.SIGKILL)
            tests.wait()


def copied(tree: Path, scratch: str, fault: Fault | None = None) -> Path:
    """Make a copy of a tree, with a fault; of a copy only what is written anew takes room."""
    copy, left_out = Path(scratch, 'tree'), shutil.ignore_patterns(*_LEFT_OUT)
    # Either way files keep their times, and so the kernels compiled from them.
    how = shutil.copy2 if fault is None else os.link
    shutil.copytree(tree, copy, ignore=left_out, copy_function=how)
    if fault is not None:
        rewrite(copy / fault.file, fault.planted(read(copy / fault.file)))
        module = '.'.join(Path(fault.file).with_suffix('').parts)
        for path in (copy / PACKAGE).rglob('*.py'):
            text = read(path)
            # Kernels have the constants and the kernels of other files compiled into them.
            if '@kernel(' in text and re.search(rf'^from {re.escape(module)} import', text, re.M):
                rewrite(path, text)
    return copy


def read(path: Path) -> str:
    """Return what a file says."""
    return path.read_text(encoding='utf-8')


def rewrite(path: Path, text: str) -> None:
    """Write a file anew, and leave alone what else is linked to it."""
    path.unlink()
    path.write_text(text, encoding='utf-8')


def judged(fault: Fault, tree: Path, suite: Suite) -> str:
    """Plant a fault in a copy of a tree, and say what its tests make of it."""
    order = suite.order(fault, read(tree / fault.file))
    with tempfile.TemporaryDirectory(prefix='faults_', ignore_cleanup_errors=True) as scratch:
        copy = copied(tree, scratch, fault)
        wanted = copy.with_name('order.json')
        wanted.write_text(json.dumps(order), encoding='utf-8')
        files = dict.fromkeys(map(file_of, order))
        try:
            code = run(copy, [f'--maxfail={BROKEN}', *files], {_ORDER: str(wanted)}, LIMIT_S)
        except subprocess.TimeoutExpired:
            return 'HUNG'
    return {FOUND: 'found', 0: 'SURVIVED'}.get(code, 'BROKE')


# What follows is pytest's, which loads this file as a plugin.
_seconds: dict[str, float] = {}


def pytest_collection_modifyitems(items: list[Any]) -> None:
    """Keep the tests that are asked for, in that order."""
    if path := os.environ.get(_ORDER):
        order = {test: place for place, test in enumerate(json.loads(read(Path(path))))}
        kept = [item for item in items if item.nodeid in order]
        items[:] = sorted(kept, key=lambda item: order[item.nodeid])


def pytest_exception_interact(node: Any, call: Any, report: Any) -> None:
    """End if a test fails by an assertion, and not by one of the package itself."""
    pytest = importlib.import_module('pytest')
    value = call.excinfo.value
    if os.environ.get(_ORDER) and getattr(report, 'when', '') == 'call':
        all_raised = getattr(value, 'exceptions', [value])
        asserts = any(isinstance(e, (AssertionError, pytest.fail.Exception)) for e in all_raised)
        if asserts and PACKAGE not in Path(call.excinfo.traceback[-1].path).parts:
            node.session.shouldstop = 'found'


def pytest_runtest_logreport(report: Any) -> None:
    """Add up how long a test takes, and forget it if it fails."""
    _seconds[report.nodeid] = _seconds.get(report.nodeid, 0.0) + report.duration
    if not report.passed:
        _seconds[report.nodeid] = float('nan')


def pytest_sessionfinish(session: Any) -> None:
    """Say whether one failed by an assertion, and what passed."""
    if session.shouldstop == 'found':
        session.exitstatus = FOUND
    if (path := os.environ.get(_SECONDS)) and not hasattr(session.config, 'workerinput'):
        passed = {test: took for test, took in _seconds.items() if took == took}
        Path(path).write_text(json.dumps(passed), encoding='utf-8')


def chosen(options: argparse.Namespace) -> Iterator[Fault]:
    """Yield the faults that are asked for."""
    if options.random:
        print(f'--random {options.random} --seed {options.seed}', flush=True)
        draw = importlib.import_module('mutants').draw
        faults = [Fault(*each) for each in draw(ROOT, PACKAGE, options.random, options.seed)]
    else:
        faults = listed()
    return (each for each in faults if options.only in each.file or options.only in each.old)


def main() -> int:
    """Plant, count and say what survived."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument('--jobs', type=int, default=2, metavar='N', help='at a time (%(default)s)')
    parser.add_argument('--only', default='', metavar='TEXT', help='of files or edits with a text')
    parser.add_argument('--random', type=int, default=0, metavar='N', help='so many, drawn')
    parser.add_argument(
        '--seed', type=int, default=random.randrange(2**32), help='of what is drawn'
    )
    parser.add_argument('--least', type=float, default=0.97, help='share to find (%(default)s)')
    options = parser.parse_args()
    ends: Counter[str] = Counter()
    with tempfile.TemporaryDirectory(prefix='faults_', ignore_cleanup_errors=True) as scratch:
        try:
            faults = list(chosen(options))
            tree = copied(ROOT, scratch)
            suite = Suite.of(tree, options.jobs)
        except ValueError as error:
            print(f'faults.py: error: {error}', file=sys.stderr)
            return 2
        print(f'{len(suite.seconds)} tests pass without a fault', flush=True)
        threads = ThreadPoolExecutor(options.jobs)
        try:
            said = {threads.submit(judged, fault, tree, suite): fault for fault in faults}
            for number, each in enumerate(as_completed(said), 1):
                fault, end = said[each], each.result()
                text = read(tree / fault.file)
                place = f'{number}/{len(faults)} {fault.file}:{fault.line(text)}'
                print(f'{place}: {end}: {fault.shown(text)}', flush=True)
                ends[end] += 1
        finally:
            # Also after Ctrl-C.
            threads.shutdown(cancel_futures=True)
    # What is drawn may only break, as what does not compile: it is no fault that could be shipped.
    counted = len(faults) - (ends['BROKE'] if options.random else 0)
    share = ends['found'] / max(counted, 1)
    others = ''.join(f', {ends[end]} {end}' for end in ('SURVIVED', 'BROKE', 'HUNG'))
    print(f'{ends["found"]} of {counted} found ({share:.1%}){others}')
    return 0 if share >= options.least else 1


if __name__ == '__main__':
    sys.exit(main())
