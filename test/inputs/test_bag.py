# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import sqlite3
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag2 import CompressionMode, StoragePlugin

from gait_segmentation.errors import SequenceError
from gait_segmentation.inputs import DamagedError, ImageSource, open_input
from test.inputs.bags import (
    ROS2,
    STEP_NS,
    compressed_fields,
    grey,
    greys,
    image_fields,
    stamp,
    write_bag1,
    write_bag2,
)

ROOT = Path(__file__).parents[2]


MCAP, SQLITE = StoragePlugin.MCAP, StoragePlugin.SQLITE3
WRITERS: dict[str, Callable[[Path, dict], Path]] = {
    'mcap': write_bag2,
    'sqlite3': lambda path, topics: write_bag2(path, topics, SQLITE),
    'ros1': lambda path, topics: write_bag1(path.with_suffix('.bag'), topics),
    'mcap, storage not named': lambda path, topics: _nameless(write_bag2(path, topics), '""'),
    'sqlite3, storage not named': lambda path, topics: _nameless(write_bag2(path, topics, SQLITE)),
    'mcap, chunks packed': partial(write_bag2, mode=CompressionMode.STORAGE),
    **{
        f'{plugin.name}, {mode.name}': partial(write_bag2, plugin=plugin, mode=mode)
        for plugin in (MCAP, SQLITE)
        for mode in (CompressionMode.MESSAGE, CompressionMode.FILE)
    },
}


def _nameless(path: Path, said: str = '') -> Path:
    about = path / 'metadata.yaml'
    lines = [
        line if 'storage_identifier' not in line else f'{line.partition(":")[0]}: {said}'
        for line in about.read_text().splitlines()
    ]
    about.write_text('\n'.join(lines))
    return path


def noisy(count: int) -> list[Any]:
    """Return images that no compression makes small; the first pixel tells the number."""
    messages = greys(count, (320, 240))
    rng = np.random.default_rng(1)
    for message in messages:
        message.data[3:] = rng.integers(0, 256, message.data.size - 3)
    return messages


def numbers(source: ImageSource) -> list[int]:
    return [int(image[0, 0, 0]) // 10 for image in source.images()]


@pytest.mark.parametrize('kind', WRITERS)
def test_frames_come_with_the_stamps_of_their_headers(kind: str, tmp_path: Path) -> None:
    source = open_input(WRITERS[kind](tmp_path / 'walk', {'/camera/image_raw': greys(6)}))
    assert (source.size, source.total) == ((60, 40), 6)
    assert source.fps == pytest.approx(1e9 / STEP_NS)
    frames = list(source.frames())
    assert [frame.number for frame in frames] == list(range(6))
    assert [frame.stamp_ns for frame in frames] == [stamp(index) for index in range(6)]
    assert [frame.recorded_ns - frame.header_ns for frame in frames] == [5_000_000] * 6
    assert {frame.frame_id for frame in frames} == {'head_camera'}
    assert numbers(source) == list(range(6))


def test_start_count_and_width_choose(tmp_path: Path) -> None:
    folder = write_bag2(tmp_path / 'walk', {'/image': greys(6)})
    # A storage file will do as well.
    for path in (folder, folder / 'walk.mcap'):
        source = open_input(path, start=2, count=3, width=30)
        assert numbers(source) == [2, 3, 4]
        assert [frame.number for frame in source.frames()] == [2, 3, 4]
        assert (source.size, source.scale, source.total) == ((30, 20), 0.5, 3)
    assert open_input(folder, start=2, count=9).total == 4


def test_compressed_images_and_other_encodings_are_read(tmp_path: Path) -> None:
    messages = [compressed_fields(grey(index), stamp(index)) for index in range(3)]
    assert numbers(open_input(write_bag2(tmp_path / 'png', {'/c': messages}))) == [0, 1, 2]
    wide = greys(2)
    for message, value in zip(wide, (4095, 2000), strict=True):
        message.encoding, message.step = 'mono16', 2 * message.width
        message.data = np.full((40, 60), value, np.uint16).view(np.uint8).ravel()
    source = open_input(write_bag2(tmp_path / 'wide', {'/c': wide}), sample_bits=12)
    assert [int(image[0, 0, 0]) for image in source.images()] == [255, 125]


def test_the_topic_is_found_or_asked_for(tmp_path: Path) -> None:
    roi = [compressed_fields(grey(1), stamp(0))]
    path = write_bag2(tmp_path / 'two', {'/left/image': greys(2), '/right/compressed': roi})
    assert numbers(open_input(path, topic='/left/image')) == [0, 1]
    assert numbers(open_input(path, topic='left/image')) == [0, 1]
    for topic in ('', '/middle'):
        with pytest.raises(SequenceError) as caught:
            open_input(path, topic=topic)
        assert '/left/image (sensor_msgs/msg/Image, 2 messages)' in str(caught.value)
        assert '/right/compressed (sensor_msgs/msg/CompressedImage' in str(caught.value)
    # A bag may have both names: the one that is written so is meant.
    path = write_bag1(tmp_path / 'both.bag', {'image': greys(3), '/image': greys(2)})
    assert numbers(open_input(path, topic='image')) == [0, 1, 2]
    assert numbers(open_input(path, topic='/image')) == [0, 1]


@pytest.mark.parametrize(
    ('options', 'shape'), [({}, (40, 60)), ({'rotate': 90, 'width': 20}, (30, 20))]
)
def test_frames_that_cannot_be_read_are_no_end(
    tmp_path: Path, options: dict[str, int], shape: tuple[int, int]
) -> None:
    messages = greys(3)
    messages[1].encoding = '32FC1'
    path = write_bag2(tmp_path / 'raw', {'/image': messages})
    frames = list(open_input(path, **options).frames())
    assert [frame.image is None for frame in frames] == [False, True, False]
    # Empty answers are made of the size that it claims.
    assert (frames[1].stamp_ns, frames[1].shape) == (stamp(1), shape)
    assert "'32FC1'" in frames[1].problem


def test_a_size_is_only_believed_of_as_many_bytes(tmp_path: Path) -> None:
    _, empty = greys(2)
    empty.height = empty.width = 8192
    empty.data = empty.data[:0]
    path = write_bag2(tmp_path / 'raw', {'/c': [*greys(1), empty]})
    assert [frame.shape for frame in open_input(path).frames()] == [(40, 60), (0, 0)]


def test_without_a_stamp_the_time_of_recording_tells_frames_apart(tmp_path: Path) -> None:
    messages = [image_fields(grey(index), 0) for index in range(2)]
    frames = list(open_input(write_bag2(tmp_path / 'walk', {'/image': messages})).frames())
    assert [frame.header_ns for frame in frames] == [0, 0]
    assert [frame.stamp_ns for frame in frames] == [stamp(0) + 5_000_000, stamp(1) + 5_000_000]


def test_the_rate_is_that_of_the_stamps_however_fast_it_was_recorded(tmp_path: Path) -> None:
    # And whatever is missing somewhere.
    messages = [image_fields(grey(index), stamp(3 * index)) for index in (0, 1, 2, 3, 20)]
    source = open_input(write_bag2(tmp_path / 'walk', {'/image': messages}))
    assert source.fps == pytest.approx(1e9 / (3 * STEP_NS))


@pytest.mark.parametrize('kind', ['mcap', 'mcap, chunks packed'])
def test_damage_in_the_middle_is_found(kind: str, tmp_path: Path) -> None:
    path = WRITERS[kind](tmp_path / 'walk', {'/image': noisy(12)})
    file = path / 'walk.mcap'
    data = bytearray(file.read_bytes())
    middle = len(data) // 2
    data[middle : middle + 300_000] = b'\xff' * 300_000
    file.write_bytes(data)
    found = []
    with pytest.raises(DamagedError, match='of 12 images on /image can be read'):
        found.extend(int(frame.image[0, 0, 0]) // 10 for frame in open_input(path).frames())
    assert found[:4] == [0, 1, 2, 3]
    assert len(found) < 12


def test_messages_that_a_bag_counts_and_does_not_have_are_damage(tmp_path: Path) -> None:
    path = WRITERS['sqlite3'](tmp_path / 'walk', {'/image': greys(5)})
    (file,) = path.glob('*.db3')
    with sqlite3.connect(file) as table:
        table.execute('delete from messages where id = 3')
    found = []
    with pytest.raises(DamagedError, match='4 of 5 images on /image can be read'):
        found.extend(open_input(path).frames())
    assert len(found) == 4


def _cut(kind: str) -> Callable[[Path], Path]:
    def made(folder: Path) -> Path:
        path = WRITERS[kind](folder / 'walk', {'/image': noisy(16)})
        file = path if path.is_file() else next(p for p in path.iterdir() if p.suffix != '.yaml')
        file.write_bytes(file.read_bytes()[: file.stat().st_size * 6 // 10])
        return path

    return made


def _without_metadata(folder: Path) -> Path:
    path = write_bag2(folder / 'walk', {'/image': greys(3)})
    (path / 'metadata.yaml').unlink()
    return path


def _without_images(folder: Path) -> Path:
    message = ROS2.types['std_msgs/msg/String'](data='hello')
    return write_bag2(folder / 'walk', {'/chatter': [message]})


def _killed(folder: Path) -> Path:
    path = WRITERS['sqlite3'](folder / 'walk', {'/image': greys(3)}) / 'walk.db3'
    recorder = sqlite3.connect(path)
    recorder.execute('PRAGMA journal_mode=WAL')
    recorder.execute("INSERT INTO messages(topic_id, timestamp, data) VALUES(1, 1, x'00')")
    recorder.commit()
    # What a process that is killed leaves.
    copy = folder / 'killed.db3'
    for end in ('', '-wal'):
        copy.with_name(copy.name + end).write_bytes(path.with_name(path.name + end).read_bytes())
    recorder.close()
    return copy


def _ros1_in_mcap(folder: Path) -> Path:
    from mcap.writer import Writer

    with (folder / 'walk.mcap').open('wb') as file:
        writer = Writer(file)
        writer.start(profile='ros1')
        writer.finish()
    return folder / 'walk.mcap'


def _nonsense(name: str) -> Callable[[Path], Path]:
    def made(folder: Path) -> Path:
        (folder / name).write_bytes(b'something else' * 9)
        return folder / name

    return made


# Some versions of rosbags leave the file that they cannot read to the garbage collector.
@pytest.mark.filterwarnings('ignore::pytest.PytestUnraisableExceptionWarning')
@pytest.mark.parametrize(
    ('made', 'said'),
    [
        (_cut('mcap'), 'mcap recover'),
        (_cut('sqlite3'), 'walk'),
        (_cut('ros1'), 'rosbag reindex'),
        (_without_metadata, 'ros2 bag reindex'),
        (_without_images, '/chatter'),
        (_killed, 'PRAGMA wal_checkpoint'),
        (_ros1_in_mcap, 'messages of ROS 1'),
        *((_nonsense(name), 'cannot be read as a bag') for name in ('a.mcap', 'a.bag', 'a.db3')),
    ],
)
def test_what_cannot_be_used_says_why(
    made: Callable[[Path], Path], said: str, tmp_path: Path
) -> None:
    path = made(tmp_path)
    with pytest.raises(SequenceError, match=said) as caught:
        list(open_input(path).frames())
    assert str(path) in str(caught.value)


def test_bags_are_read_without_ros_and_without_rosbags_it_is_said_what_to_install(
    tmp_path: Path,
) -> None:
    path = write_bag2(tmp_path / 'walk', {'/image': greys(2)})
    others = [tmp_path / name for name in ('a.mcap', 'a.db3', 'a.bag')]
    for other in others:
        other.write_bytes(b'')
    program = f"""
import sys
from pathlib import Path
sys.modules.update(dict.fromkeys(['rclpy', 'sensor_msgs', 'std_msgs']))
from gait_segmentation.errors import SequenceError
from gait_segmentation.inputs import open_input
print(len(list(open_input(Path({str(path)!r})).images())))
for name in [each for each in sys.modules if each.split('.')[0] in ('rosbags', 'mcap')]:
    sys.modules[name] = None
for other in {[*map(str, others)]}:
    try:
        open_input(Path(other))
    except SequenceError as error:
        print(error)
"""
    done = subprocess.run(
        [sys.executable, '-c', program], capture_output=True, text=True, cwd=ROOT
    )
    count, *said = done.stdout.splitlines()
    assert count == '2', done.stderr
    for line, other in zip(said, others, strict=True):
        expected = f'{other} is a bag: the Python package rosbags is not installed: pip install'
        assert line.startswith(expected)
