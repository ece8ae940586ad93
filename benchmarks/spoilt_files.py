# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Small valid inputs of every kind that the commands take, how they take them, and mutations."""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from random import Random

import cv2
import numpy as np
from rosbags.rosbag2 import CompressionMode, StoragePlugin

from benchmarks.synthetic import SyntheticConfig, SyntheticSequence
from gait_segmentation.segmentation.vocabulary import default_vocabulary
from test.inputs.bags import (
    compressed_fields,
    image_fields,
    stamp,
    write_bag1,
    write_bag2,
    write_compressed_bag2,
)
from test.walkers import small_bank

_CLIP = SyntheticConfig(seed=6, frames=4, width=96, height=80, person_height=50.0)
_ALONE = {
    'alone.mcap': 'bag_mcap/bag_mcap.mcap',
    'alone.db3': 'bag_sqlite/bag_sqlite.db3',
    'alone.db3.zstd': 'packed/packed.db3.zstd',
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
    write_compressed_bag2(folder / 'bag_zstd', raw, CompressionMode.MESSAGE, sqlite)
    write_compressed_bag2(folder / 'packed', raw, CompressionMode.FILE, sqlite)
    write_bag1(folder / 'ros1.bag', raw)
    for name, source in _ALONE.items():
        (folder / name).write_bytes((folder / source).read_bytes())
    clip.write(folder / 'sequence')
    heats = [cv2.blur(frame.truths[0], (9, 9)) for frame in clip]
    _write_images(folder / 'sequence/heat', heats)
    (folder / 'params.yaml').write_text(_PARAMS)
    small_bank().save(folder / 'bank.npz')
    default_vocabulary().save(folder / 'words.json')
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


_HUGE = (0, 1, 0x7F, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)
_WORDS = ('1e400', '-1', '.nan', '.inf', '9' * 30, '9' * 5000, "'x'", '[]', '{}', '~', 'true',
          '2001-99-99', '\\x00', '*a', '&a [*a]', '[' * 3000, '{a: ' * 3000, '1e-320')  # fmt: skip
_NAMES = ('9' * 40, '-x', 'ä ö', 'a\nb', '\udcff', 'x' * 240, '.hidden', '0')


def _place(rng: Random, data: bytes) -> int:
    """Return a place, in the first bytes as often as anywhere."""
    return rng.randrange(max(min(len(data), rng.choice([64, len(data)])), 1))


def _flip(rng: Random, data: bytes) -> bytes:
    made = bytearray(data)
    for _ in range(rng.choice([1, 3, 30]) if data else 0):
        made[_place(rng, data)] ^= 1 << rng.randrange(8)
    return bytes(made)


def _replace(rng: Random, data: bytes) -> bytes:
    """Put something else in the place of a piece: nothing, zeros, garbage, another piece."""
    at, other = _place(rng, data), _place(rng, data)
    old = data[at : at + rng.choice([9, 400, 4096, len(data)])]
    garbage = rng.randbytes(rng.choice([1, 16, 1000]))
    new = rng.choice([b'', bytes(len(old)), garbage, data[other:], old[:9999] * 50])
    return data[:at] + new + data[at + len(old) :]


def _number(rng: Random, data: bytes) -> bytes:
    at, form = _place(rng, data), rng.choice('<>') + rng.choice('HIQ')
    value = rng.choice(_HUGE) & (2 ** (8 * struct.calcsize(form)) - 1)
    return data[:at] + struct.pack(form, value) + data[at + struct.calcsize(form) :]


def _size(rng: Random, data: bytes) -> bytes:
    """Let an image claim another size, in a PNG with the right sum."""
    width, height = (rng.choice([0, 1, 3, 70_000, 2**31 - 1]) for _ in range(2))
    if data[:4] == b'\x89PNG':
        header = data[12:16] + struct.pack('>II', width, height) + data[24:29]
        return data[:12] + header + struct.pack('>I', zlib.crc32(header)) + data[33:]
    at = data.find(b'\xff\xc0')
    if at > 0:
        return data[: at + 5] + struct.pack('>HH', height & 65535, width & 65535) + data[at + 9 :]
    return _number(rng, data)


def _text(rng: Random, data: bytes) -> bytes:
    """Change a value of a text."""
    word = rng.choice(_WORDS).encode()
    at = [index for index, byte in enumerate(data[:20_000]) if byte in b':,[']
    place = rng.choice(at) + 1 if at else 0
    end = min((e for e in (data.find(b, place) for b in b',]}\n') if e >= 0), default=len(data))
    return data[:place] + b' ' + word + data[end:]


def _forbidden(rng: Random, path: Path) -> None:
    path.write_bytes(b'secret')
    path.chmod(0)


CHANGES: dict[str, Callable[[Random, bytes], bytes]] = {
    'flip': _flip,
    'replace': _replace,
    'truncate': lambda rng, data: data[: rng.randrange(len(data) + 1)],
    'number': _number,
    'size': _size,
    'text': _text,
    'empty': lambda rng, data: b'',
}
_DEVICES = ('/dev/null', '/dev/zero', '/dev/full', '/dev/tty')
_REPLACEMENTS: dict[str, Callable[[Random, Path], object]] = {
    'fifo': lambda rng, path: os.mkfifo(path),
    'device': lambda rng, path: path.symlink_to(rng.choice(_DEVICES)),
    'folder': lambda rng, path: path.mkdir(),
    'link in a circle': lambda rng, path: path.symlink_to(path.name),
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
