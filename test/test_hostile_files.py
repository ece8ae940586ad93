# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Spoilt films, images, bags, parameter files, banks, words and sequences, given to the commands.

Each ends with an exit code that it documents and, if that is an error, a line that says so;
without a traceback, with its inputs as they were, and without files half written.
"""

from __future__ import annotations

import importlib
import re
import resource
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given, strategies as st
from rosbags.rosbag2 import CompressionMode, StoragePlugin

from benchmarks.synthetic import SyntheticConfig, SyntheticSequence
from gait_segmentation.paper.vocabulary import default_vocabulary
from gait_tools.vocabulary_training import write_vocabulary
from test.hostile import examples, spoilt_bytes
from test.inputs.bags import compressed_fields, image_fields, stamp, write_bag1, write_bag2
from test.walkers import small_bank

RECORDINGS = ('film.mp4', 'png', 'jpg', 'ros1.bag', 'mcap', 'sqlite', 'jpeg_bag', 'zstd')
PARAMETERS = """\
/**:
  ros__parameters: {max_people: 2, matching: {lag: 1, window: 1.5}}
/robot/gait_tracker:
  ros__parameters:
    initial_box: [10, 12, 30.5, 50]
"""
MEMORY = 12 << 30
"""Bytes of addresses, so that a mistake does not take the whole machine."""


def write_images(folder: Path, images: list[np.ndarray], suffix: str) -> None:
    folder.mkdir()
    for number, image in enumerate(images):
        cv2.imwrite(str(folder / f'{number:04d}.{suffix}'), image)


@pytest.fixture(scope='module')
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a valid input of every kind."""
    folder = tmp_path_factory.mktemp('good')
    clip = SyntheticSequence(SyntheticConfig(6, 96, 80, frames=4, person_height=50.0))
    images = [frame.image for frame in clip]
    film = cv2.VideoWriter(str(folder / 'film.mp4'), cv2.VideoWriter.fourcc(*'mp4v'), 25, (96, 80))
    for image in images:
        film.write(image)
    film.release()
    for suffix in ('png', 'jpg'):
        write_images(folder / suffix, images, suffix)
    raw = {'/image': [image_fields(each, stamp(n)) for n, each in enumerate(images)]}
    packed = {
        '/image': [compressed_fields(each, stamp(n), 'jpeg') for n, each in enumerate(images)]
    }
    write_bag1(folder / 'ros1.bag', raw)
    write_bag2(folder / 'mcap', raw)
    write_bag2(folder / 'sqlite', raw, StoragePlugin.SQLITE3)
    write_bag2(folder / 'jpeg_bag', packed)
    write_bag2(folder / 'zstd', raw, StoragePlugin.SQLITE3, CompressionMode.MESSAGE)
    clip.write(folder / 'sequence')
    (folder / 'params.yaml').write_text(PARAMETERS)
    small_bank().save(folder / 'bank.npz')
    write_vocabulary(default_vocabulary(), folder / 'words.json')
    silhouette = np.where(np.pad(small_bank().templates[0, 0], 8) > 127, 255, 0)
    write_images(folder / 'silhouettes', [silhouette.astype(np.uint8)] * 3, 'png')
    return folder


@pytest.fixture(autouse=True)
def surroundings() -> Iterator[None]:
    threads, limits = cv2.getNumThreads(), resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, limits[1]))
    yield
    resource.setrlimit(resource.RLIMIT_AS, limits)
    cv2.setNumThreads(threads)


COMMANDS = {
    # A box outside of every image ends gait_demo before it starts nodes.
    **dict.fromkeys(RECORDINGS, (
        'gait_replay {0} --out out --bank {1}/bank.npz --masks masks --overlay overlay.mp4',
        'gait_replay {0} --out out --bank {1}/bank.npz --csv table.csv --opengait gait',
        'gait_demo --clip {0} --box 9e9 0 1 1 --out demo')),
    'sequence': ('gait_evaluate {0} --out eval --json a.json', 'gait_evaluate {0} --init auto'),
    'params.yaml': ('gait_replay {1}/film.mp4 --out out --bank {1}/bank.npz --params {0}',),
    'bank.npz': ('gait_replay {1}/film.mp4 --count 2 --out out --bank {0}', 'gait_bank info {0}',
                 'gait_bank show {0} -o bank.png'),
    'words.json': ('gait_replay {1}/film.mp4 --out out --bank {1}/bank.npz '
                   '--set segmentation.prior=paper --set segmentation.vocabulary={0}',),
    'silhouettes': ('gait_bank build made.npz --from {0} --azimuth 0',
                    'gait_bank vocabulary made.json --from {0} --words 2 --points 300'),
}  # fmt: skip


def spoil(draw: Any, spoilt: Path) -> None:
    """Change a file, or put something else or nothing in its place."""
    files = sorted(each for each in spoilt.rglob('*') if each.is_file()) or [spoilt]
    file = draw(st.sampled_from(files))
    how = draw(st.sampled_from((*['bytes'] * 6, 'gone', 'folder', 'link', 'forbidden', 'renamed')))
    if how == 'bytes':
        file.write_bytes(draw(spoilt_bytes(file.read_bytes())))
    elif how == 'forbidden':
        file.chmod(0)
    elif how == 'renamed' and file != spoilt:
        file.rename(file.with_name(draw(st.sampled_from(('9' * 40, '-x', 'ä ö', 'x' * 240)))))
    else:
        file.unlink()
        if how == 'folder':
            file.mkdir()
        elif how == 'link':
            file.symlink_to('nowhere')


def state(folder: Path) -> list[tuple[Path, object]]:
    """Return what is in a folder."""
    return [(path, path.is_file() and path.read_bytes()) for path in sorted(folder.rglob('*'))]


@examples(40, 200)
@given(data=st.data())
def test_a_spoilt_file_is_read_as_far_as_it_can_be_or_refused(
    good: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, data: Any
) -> None:
    with tempfile.TemporaryDirectory() as scratch, monkeypatch.context() as here:
        here.chdir(scratch)
        kind = data.draw(st.sampled_from(sorted(COMMANDS)))
        spoilt = Path('given', kind)
        spoilt.parent.mkdir()
        (shutil.copytree if (good / kind).is_dir() else shutil.copy)(good / kind, spoilt)
        spoil(data.draw, spoilt)
        line = data.draw(st.sampled_from(COMMANDS[kind])).format(spoilt, good)
        name, *words = line.split()
        before = state(spoilt.parent)
        package = 'gait_segmentation' if name == 'gait_replay' else 'gait_tools'
        main = importlib.import_module(f'{package}.cli.{name.removeprefix("gait_")}').main
        capfd.readouterr()
        code = main(words)
        said = ''.join(capfd.readouterr())
        assert code in ({0, 1, 2} if name == 'gait_replay' else {0, 2}), line
        assert code != 2 or f'{name}: error: ' in said, line
        assert not re.search('Traceback|Exception ignored', said), said
        assert state(spoilt.parent) == before, line
        left = [path for path in Path().rglob('.*') if re.search(r'\.(part|lock)', path.name)]
        assert not left, line
