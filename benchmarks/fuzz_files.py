#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Damaged and hostile files given to all commands.

Small valid inputs of every kind (films, folders, bags, sequences, parameter files, banks,
vocabularies, silhouettes) are changed by chance: cut off, flipped, spliced, with huge numbers,
missing, a folder, forbidden ...; some commands find a full disk, and some are told to write to
what they read.  Each must end in time with an exit code that it documents and, if that is an
error, a line that says so; without a traceback, with its inputs as they were, and without hidden
files left.
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
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from random import Random

import cv2
import numpy as np
from hypothesis import strategies as st
from rosbags.rosbag2 import CompressionMode, StoragePlugin

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.fuzzing import CHANGES, fuzz
from benchmarks.synthetic import SyntheticConfig, SyntheticSequence
from gait_segmentation.cli.tool import run_tool
from gait_segmentation.paper.vocabulary import default_vocabulary
from gait_tools.vocabulary_training import write_vocabulary
from test.inputs.bags import (
    compressed_fields,
    image_fields,
    stamp,
    write_bag1,
    write_bag2,
)
from test.walkers import small_bank

MODULES = {
    'gait_replay': 'gait_segmentation.cli.replay',
    'gait_evaluate': 'gait_tools.cli.evaluate',
    'gait_bank': 'gait_tools.cli.bank',
    'gait_demo': 'gait_tools.cli.demo',
    'gait_source': 'gait_tools.cli.source',
}
CODES = {'gait_replay': {0, 1, 2}, 'gait_source': {0, 1, 2}}
"""Exit codes that are documented; 0 and 2 of the others."""

TRACES = ('Traceback (most recent call last)', 'Exception ignored', 'None:', 'Fatal Python error')
PROCESSES, FULL_DISKS, SAME = 0.02, 0.1, 0.05
"""Shares of the cases that are processes of their own, with a full disk, and over the input."""

MEMORY = 12 << 30
"""Bytes of addresses, so that a mistake does not take the whole machine."""

_CLIP = SyntheticConfig(seed=6, frames=4, width=96, height=80, person_height=50.0)
_ALONE = {
    'alone.mcap': 'bag_mcap/bag_mcap.mcap',
    'alone.db3': 'bag_sqlite/bag_sqlite.db3',
}
"""Recordings that are copies of others."""

_RECORDINGS = (
    *('film.mp4', 'film.avi', 'png', 'jpg', 'ros1.bag'),
    *('bag_mcap', 'bag_sqlite', 'bag_jpeg', 'bag_zstd', *_ALONE),
)
KINDS = (*_RECORDINGS, 'sequence', 'params.yaml', 'bank.npz', 'words.json', 'silhouettes')
"""Names of the inputs in their folder."""

PLACES = {
    '--masks': 'masks',
    '--overlay': 'overlay.mp4',
    '--csv': 'table.csv',
    '--opengait': 'gait',
    '--stamps': 'stamps.txt',
    '--json': 'a.json',
}
"""Where the commands write to, by the option that says so; the others write to ``--out``."""

_PARAMS = """\
/**:
  ros__parameters:
    max_people: 2
    matching: {lag: 1, window: 1.5}
    segmentation.prior: default
/robot/gait_tracker:
  ros__parameters:
    initial_box: [10, 12, 30.5, 50]
    tracking.use_tilt: true
"""


def _write_images(folder: Path, images: list[np.ndarray], suffix: str = 'png') -> None:
    folder.mkdir()
    for number, image in enumerate(images):
        cv2.imwrite(str(folder / f'{number:04d}.{suffix}'), image)


def make_inputs(folder: Path) -> None:
    """Write one input of every kind."""
    clip = SyntheticSequence(_CLIP)
    frames = [frame.image for frame in clip]
    for name, code in (('film.mp4', 'mp4v'), ('film.avi', 'MJPG')):
        size = frames[0].shape[1::-1]
        film = cv2.VideoWriter(str(folder / name), cv2.VideoWriter.fourcc(*code), 25, size)
        for frame in frames:
            film.write(frame)
        film.release()
    for suffix in ('png', 'jpg'):
        _write_images(folder / suffix, frames, suffix)
    raw = {'/image': [image_fields(each, stamp(index)) for index, each in enumerate(frames)]}
    jpeg = {'/image': [compressed_fields(each, stamp(n), 'jpeg') for n, each in enumerate(frames)]}
    sqlite = StoragePlugin.SQLITE3
    write_bag2(folder / 'bag_mcap', raw)
    write_bag2(folder / 'bag_sqlite', raw, sqlite)
    write_bag2(folder / 'bag_jpeg', jpeg)
    write_bag2(folder / 'bag_zstd', raw, sqlite, CompressionMode.MESSAGE)
    write_bag1(folder / 'ros1.bag', raw)
    for name, source in _ALONE.items():
        (folder / name).write_bytes((folder / source).read_bytes())
    clip.write(folder / 'sequence')
    heats = [cv2.blur(frame.truths[0], (9, 9)) for frame in clip]
    _write_images(folder / 'sequence/heat', heats)
    (folder / 'params.yaml').write_text(_PARAMS)
    small_bank().save(folder / 'bank.npz')
    write_vocabulary(default_vocabulary(), folder / 'words.json')
    silhouette = np.where(np.pad(small_bank().templates[0, 0], 8) > 127, 255, 0).astype(np.uint8)
    _write_images(folder / 'silhouettes', [silhouette] * 3)


def command_of(kind: str, rng: Random, given: str, good: Path) -> list[str]:
    """
    Return a command line that reads an input.

    :param given: the input's name.
    :param good: the folder of valid inputs.
    """
    out, bank = ['--out', 'out'], ['--bank', str(good / 'bank.npz')]
    short = ['gait_replay', str(good / 'film.mp4'), '--count', '2', *out]
    if kind in _RECORDINGS:
        chosen = [each for each in list(PLACES.items())[:4] if rng.random() < 0.25]
        options = [word for option_and_place in chosen for word in option_and_place]
        options += ['--force'] if rng.random() < 0.2 else []
        replay = ['gait_replay', given, *out, *bank, *options]
        # A box outside of every image ends gait_demo before it starts nodes.
        demo = ['gait_demo', '--clip', given, '--box', '9e9', '0', '1', '1', '--out', 'demo']
        source = ['gait_source', given, '--rate', '1000', '--stamps', 'stamps.txt']
        return rng.choice([replay, replay, replay, replay, source, demo])
    if kind == 'sequence':
        more = rng.choice([[], ['--likelihood', 'heat'], ['--init', 'auto'], ['--restarts']])
        return ['gait_evaluate', given, '--out', 'eval', '--json', 'a.json', *more]
    if kind == 'params.yaml':
        return [*short, *bank, '--params', given]
    if kind == 'words.json':
        settings = (f'segmentation.vocabulary={given}', 'segmentation.prior=paper')
        return [*short, *bank, *(word for each in settings for word in ('--set', each))]
    if kind == 'bank.npz':
        info, show = ['info', given, '--json'], ['show', given, '-o', 'bank.png']
        return rng.choice([[*short, '--bank', given], ['gait_bank', *info], ['gait_bank', *show]])
    build = ['build', 'made.npz', '--from', given, '--azimuth', '0']
    words = ['vocabulary', 'made.json', '--from', given, '--words', '2', '--points', '300']
    return ['gait_bank', *rng.choice([build, [*words, '--picture', 'words.png']])]


_NAMES = ('9' * 40, '-x', 'ä ö', 'a\nb', 'x' * 240, '.hidden', '0')


def _forbidden(rng: Random, path: Path) -> None:
    path.write_bytes(b'secret')
    path.chmod(0)


_REPLACEMENTS: dict[str, Callable[[Random, Path], object]] = {
    'folder': lambda rng, path: path.mkdir(),
    'link to nothing': lambda rng, path: path.symlink_to('nowhere'),
    'missing': lambda rng, path: None,
    'forbidden': _forbidden,
}
MUTATIONS = (*[*CHANGES] * 2, *_REPLACEMENTS, 'name')
"""What may have become of a file."""


def mutate(path: Path, how: str, rng: Random) -> Path:
    """
    Change an input, one of its files if it is a folder.

    :returns: where the input is now.
    """
    files = sorted(each for each in path.rglob('*') if each.is_file()) or [path]
    if how == 'text':
        files = [each for each in files if each.suffix in ('.yaml', '.json')] or files
    chosen = rng.choice(files)
    if how == 'name':
        moved = chosen.rename(chosen.with_name(rng.choice(_NAMES) + chosen.suffix))
        return moved if chosen == path else path
    if how in CHANGES:
        chosen.write_bytes(CHANGES[how](rng, chosen.read_bytes()))
    else:
        chosen.unlink()
        _REPLACEMENTS[how](rng, chosen)
    return path


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
