# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Small valid inputs of every kind that the commands take, and how the commands take them."""

from __future__ import annotations

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

__all__ = ['KINDS', 'command_of', 'make_inputs']

FRAMES = 4
_CLIP = SyntheticConfig(seed=6, frames=FRAMES, width=96, height=80, person_height=50.0)

RECORDINGS = (
    'film.mp4',
    'film.avi',
    'png',
    'jpg',
    'bag_mcap',
    'bag_sqlite',
    'bag_jpeg',
    'bag_zstd',
    'alone.mcap',
    'alone.db3',
    'alone.db3.zstd',
    'ros1.bag',
)
KINDS = (*RECORDINGS, 'sequence', 'params.yaml', 'bank.npz', 'words.json', 'silhouettes')
"""Names of the inputs in their folder."""

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
        (folder / suffix).mkdir()
        for number, frame in enumerate(frames):
            cv2.imwrite(str(folder / suffix / f'{number:04d}.{suffix}'), frame)
    _write_bags(folder, frames)
    clip.write(folder / 'sequence')
    (folder / 'sequence/heat').mkdir()
    for number, truth in enumerate(frame.truths[0] for frame in clip):
        cv2.imwrite(str(folder / f'sequence/heat/{number:04d}.png'), cv2.blur(truth, (9, 9)))
    (folder / 'params.yaml').write_text(_PARAMS)
    small_bank().save(folder / 'bank.npz')
    default_vocabulary().save(folder / 'words.json')
    (folder / 'silhouettes').mkdir()
    for number, template in enumerate(np.tile(small_bank().templates[0], (3, 1, 1))):
        silhouette = np.where(np.pad(template, 8) > 127, 255, 0).astype(np.uint8)
        cv2.imwrite(str(folder / f'silhouettes/{number:04d}.png'), silhouette)


def _write_bags(folder: Path, frames: list[np.ndarray]) -> None:
    raw = {'/image': [image_fields(each, stamp(index)) for index, each in enumerate(frames)]}
    jpeg = {'/image': [compressed_fields(each, stamp(n), 'jpeg') for n, each in enumerate(frames)]}
    sqlite = StoragePlugin.SQLITE3
    write_bag2(folder / 'bag_mcap', raw)
    write_bag2(folder / 'bag_sqlite', raw, sqlite)
    write_bag2(folder / 'bag_jpeg', jpeg)
    write_compressed_bag2(folder / 'bag_zstd', raw, CompressionMode.MESSAGE, sqlite)
    write_compressed_bag2(folder / 'packed', raw, CompressionMode.FILE, sqlite)
    write_bag1(folder / 'ros1.bag', raw)
    for source, name in (
        ('bag_mcap/bag_mcap.mcap', 'alone.mcap'),
        ('bag_sqlite/bag_sqlite.db3', 'alone.db3'),
        ('packed/packed.db3.zstd', 'alone.db3.zstd'),
    ):
        (folder / name).write_bytes((folder / source).read_bytes())


def command_of(kind: str, rng: Random, given: str, good: Path) -> list[str]:
    """
    Return a command line that reads an input.

    :param given: the input's name.
    :param good: the folder of valid inputs.
    """
    # A box outside of every image ends gait_demo before it starts nodes.
    nowhere = ['--box', '9e9', '0', '1', '1']
    bank = ['--bank', str(good / 'bank.npz'), '--out', 'out']
    if kind in RECORDINGS:
        command = rng.choice(['gait_replay'] * 4 + ['gait_source', 'gait_demo'])
        if command == 'gait_replay':
            return [command, given, *bank, *_outputs(rng)]
        if command == 'gait_source':
            return [command, given, '--rate', '1000', '--stamps', 'stamps.txt']
        return [command, '--clip', given, *nowhere, '--out', 'demo']
    if kind == 'sequence':
        more = [[], ['--likelihood', 'heat'], ['--init', 'auto'], ['--restarts']]
        return ['gait_evaluate', given, '--out', 'eval', '--json', 'a.json', *rng.choice(more)]
    film = [str(good / 'film.mp4'), '--count', '2']
    if kind == 'params.yaml':
        return ['gait_replay', *film, *bank, '--params', given]
    if kind == 'words.json':
        words = ['--set', f'segmentation.vocabulary={given}', '--set', 'segmentation.prior=paper']
        return ['gait_replay', *film, *bank, *words]
    if kind == 'bank.npz':
        return rng.choice(
            [
                ['gait_replay', *film, '--out', 'out', '--bank', given],
                ['gait_bank', 'info', given, '--json'],
                ['gait_bank', 'show', given, '-o', 'bank.png'],
            ]
        )
    build = ['gait_bank', 'build', 'made.npz', '--from', given, '--azimuth', '0']
    words = ['gait_bank', 'vocabulary', 'made.json', '--from', given, '--words', '2']
    return rng.choice([build, [*words, '--points', '300', '--picture', 'words.png']])


def _outputs(rng: Random) -> list[str]:
    places = {
        '--masks': 'masks',
        '--overlay': 'overlay.mp4',
        '--csv': 'table.csv',
        '--opengait': 'gait',
    }
    chosen = [each for each in places.items() if rng.random() < 0.25]
    options = [word for option_and_place in chosen for word in option_and_place]
    return [*options, *(['--force'] if rng.random() < 0.2 else [])]
