# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag2 import CompressionMode, StoragePlugin

from gait_segmentation.errors import SequenceError
from gait_segmentation.inputs import DamagedError, ImageSource, open_input
from test.files.test_encoded_images import HUGE
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
    write_compressed_bag2,
)

ROOT = Path(__file__).parents[2]
BIG = (320, 240)
IMAGES_OF_CHUNK = 5
"""Of that size, in MCAP."""


def sqlite_bag(path: Path, topics: dict) -> Path:
    return write_bag2(path, topics, StoragePlugin.SQLITE3)


WRITERS: dict[str, Callable[[Path, dict], Path]] = {
    'mcap': write_bag2,
    'mcap compressed': write_compressed_bag2,
    'sqlite3': sqlite_bag,
    'ros1': lambda path, topics: write_bag1(path.with_suffix('.bag'), topics),
}


def noisy(count: int) -> list[Any]:
    """Return images that no compression makes small; the first pixel tells the number."""
    messages = greys(count, BIG)
    rng = np.random.default_rng(1)
    for message in messages:
        message.data[3:] = rng.integers(0, 256, message.data.size - 3)
    return messages


def numbers(source: ImageSource) -> list[int]:
    return [int(image[0, 0, 0]) // 10 for image in source.images()]


@pytest.mark.parametrize('kind', WRITERS)
def test_frames_come_with_the_stamps_of_their_headers(kind: str, tmp_path: Path) -> None:
    path = WRITERS[kind](tmp_path / 'walk', {'/camera/image_raw': greys(6)})
    source = open_input(path)
    assert isinstance(source.fps, float)
    assert (source.size, source.total) == ((60, 40), 6)
    assert source.fps == pytest.approx(1e9 / STEP_NS)
    frames = list(source.frames())
    assert [frame.number for frame in frames] == list(range(6))
    assert [frame.stamp_ns for frame in frames] == [stamp(index) for index in range(6)]
    assert [frame.recorded_ns - frame.header_ns for frame in frames] == [5_000_000] * 6
    assert {frame.frame_id for frame in frames} == {'head_camera'}
    assert numbers(source) == list(range(6))


def test_start_count_and_width_choose(tmp_path: Path) -> None:
    path = write_bag2(tmp_path / 'walk', {'/image': greys(6)})
    source = open_input(path, start=2, count=3, width=30)
    assert numbers(source) == [2, 3, 4]
    assert [frame.number for frame in source.frames()] == [2, 3, 4]
    assert (source.size, source.scale, source.total) == ((30, 20), 0.5, 3)
    with pytest.raises(SequenceError, match='has no frame 6'):
        open_input(path, start=6)


def test_a_storage_file_will_do_and_a_folder_without_metadata_is_to_be_mended(
    tmp_path: Path,
) -> None:
    folder = write_bag2(tmp_path / 'walk', {'/image': greys(3)})
    assert numbers(open_input(folder / 'walk.mcap')) == [0, 1, 2]
    (folder / 'metadata.yaml').unlink()
    with pytest.raises(SequenceError, match='mend it: ros2 bag reindex FOLDER'):
        open_input(folder)


@pytest.mark.parametrize('plugin', [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
@pytest.mark.parametrize('mode', [CompressionMode.MESSAGE, CompressionMode.FILE])
def test_packed_messages_and_files_are_read(
    plugin: StoragePlugin, mode: CompressionMode, tmp_path: Path
) -> None:
    folder = write_compressed_bag2(tmp_path / 'walk', {'/image': noisy(12)}, mode, plugin)
    (file,) = (path for path in folder.iterdir() if path.suffix != '.yaml')
    assert numbers(open_input(folder)) == list(range(12))
    if mode == CompressionMode.FILE:
        with pytest.raises(SequenceError, match='mend it: zstd -d FILE'):
            open_input(file)
    else:
        assert numbers(open_input(file)) == list(range(12))


def test_bags_have_stamps_and_no_rate(tmp_path: Path) -> None:
    bag = write_bag2(tmp_path / 'walk', {'/image': greys(3)})
    with pytest.raises(SequenceError, match='leave out --rate'):
        open_input(bag, rate=10)


def test_compressed_images_and_other_encodings_are_read(tmp_path: Path) -> None:
    messages = [compressed_fields(grey(index), stamp(index)) for index in range(3)]
    assert numbers(open_input(write_bag2(tmp_path / 'png', {'/c': messages}))) == [0, 1, 2]
    rgb = np.zeros((4, 6, 3), np.uint8)
    rgb[:] = (10, 20, 30)
    path = write_bag2(tmp_path / 'rgb', {'/c': [image_fields(rgb, stamp(0), 'rgb8')]})
    (image,) = open_input(path).images()
    assert image[0, 0].tolist() == [30, 20, 10]


def test_the_topic_is_found_or_asked_for(tmp_path: Path) -> None:
    roi = [compressed_fields(grey(1), stamp(0))]
    path = write_bag2(tmp_path / 'two', {'/left/image': greys(2), '/right/compressed': roi})
    with pytest.raises(
        SequenceError, match=r'2 topics with images, choose one with --topic .*: '
    ) as e:
        open_input(path)
    assert '/left/image (sensor_msgs/msg/Image, 2 messages)' in str(e.value)
    assert '/right/compressed (sensor_msgs/msg/CompressedImage, 1 messages)' in str(e.value)
    assert numbers(open_input(path, topic='/left/image')) == [0, 1]
    assert numbers(open_input(path, topic='left/image')) == [0, 1]
    with pytest.raises(SequenceError, match=r'topic /middle is not there; .*/left/image'):
        open_input(path, topic='/middle')


def test_a_frame_that_cannot_be_read_is_no_end(tmp_path: Path) -> None:
    messages = greys(3)
    messages[1].encoding = '32FC1'
    source = open_input(write_bag2(tmp_path / 'walk', {'/image': messages}))
    frames = list(source.frames())
    assert [frame.image is None for frame in frames] == [False, True, False]
    assert frames[1].stamp_ns == stamp(1)
    assert frames[1].shape == (40, 60)
    assert "'32FC1'" in frames[1].problem


def test_without_a_stamp_the_time_of_recording_tells_frames_apart(tmp_path: Path) -> None:
    messages = [image_fields(grey(index), 0) for index in range(2)]
    frames = list(open_input(write_bag2(tmp_path / 'walk', {'/image': messages})).frames())
    assert [frame.header_ns for frame in frames] == [0, 0]
    assert [frame.stamp_ns for frame in frames] == [stamp(0) + 5_000_000, stamp(1) + 5_000_000]


# Some versions of rosbags leave the file that they cannot read to the garbage collector.
@pytest.mark.filterwarnings('ignore::pytest.PytestUnraisableExceptionWarning')
@pytest.mark.parametrize(
    ('kind', 'remedy'),
    [('mcap', 'mcap recover FILE'), ('sqlite3', 'sqlite3 FILE'), ('ros1', 'rosbag reindex FILE')],
)
def test_a_bag_that_was_cut_off_names_what_mends_it(
    kind: str, remedy: str, tmp_path: Path
) -> None:
    path = WRITERS[kind](tmp_path / 'walk', {'/image': noisy(16)})
    file = path if path.is_file() else next(p for p in path.iterdir() if p.suffix != '.yaml')
    whole = file.read_bytes()
    file.write_bytes(whole[: len(whole) * 6 // 10])
    with pytest.raises(SequenceError, match=f'{path.name} .*; mend it: {remedy}'):
        list(open_input(path).frames())


@pytest.mark.parametrize('kind', ['mcap', 'mcap compressed'])
def test_damage_in_the_middle_is_found(kind: str, tmp_path: Path) -> None:
    path = WRITERS[kind](tmp_path / 'walk', {'/image': noisy(12)})
    file = path / 'walk.mcap'
    data = bytearray(file.read_bytes())
    middle = len(data) // 2
    data[middle : middle + 300_000] = b'\xff' * 300_000
    file.write_bytes(data)
    found = []
    with pytest.raises(DamagedError, match='images on /image can be read'):
        found.extend(int(frame.image[0, 0, 0]) // 10 for frame in open_input(path).frames())
    assert found[:4] == [0, 1, 2, 3]
    assert len(found) < 12


@pytest.mark.parametrize('name', ['empty.mcap', 'empty.bag', 'empty.db3'])
def test_what_is_no_bag_is_an_error(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_bytes(b'')
    with pytest.raises(SequenceError, match='cannot be read as a bag'):
        open_input(path)
    path.write_bytes(b'something else' * 9)
    with pytest.raises(SequenceError, match='cannot be read as a bag'):
        open_input(path)


def test_a_bag_without_images_lists_what_it_has(tmp_path: Path) -> None:

    message = ROS2.types['std_msgs/msg/String'](data='hello')
    path = write_bag2(tmp_path / 'talk', {'/chatter': [message]})
    with pytest.raises(SequenceError, match=r'no images .*: /chatter \(std_msgs/msg/String, 1 me'):
        open_input(path)


def test_bags_are_read_without_ros(tmp_path: Path) -> None:
    path = write_bag2(tmp_path / 'walk', {'/image': greys(2)})
    program = (
        'import sys, pathlib\n'
        'for name in ("rclpy", "sensor_msgs", "std_msgs"): sys.modules[name] = None\n'
        'from gait_segmentation.inputs import open_input\n'
        f'print(len(list(open_input(pathlib.Path({str(path)!r})).images())))'
    )
    done = subprocess.run(
        [sys.executable, '-c', program], capture_output=True, text=True, cwd=ROOT, check=False
    )
    assert done.stdout.strip() == '2', done.stderr


@pytest.mark.parametrize('name', ['metadata.yaml', 'walk.mcap', 'other'])
def test_a_pipe_in_a_bag_does_not_block(name: str, tmp_path: Path) -> None:
    path = write_bag2(tmp_path / 'walk', {'/image': greys(2)})
    (path / name).unlink(missing_ok=True)
    os.mkfifo(path / name)
    with pytest.raises(SequenceError, match=f'{name} cannot be read: it is a pipe and no file'):
        open_input(path)


def test_frames_that_claim_too_many_pixels_are_no_end(tmp_path: Path) -> None:
    messages = [compressed_fields(grey(index), stamp(index)) for index in range(3)]
    messages[1].data = np.frombuffer(HUGE['png'], np.uint8)
    frames = list(open_input(write_bag2(tmp_path / 'png', {'/c': messages})).frames())
    assert [frame.image is None for frame in frames] == [False, True, False]
    assert 'image must have at most 67108864 pixels' in frames[1].problem
    path = write_bag2(tmp_path / 'raw', {'/c': [*greys(1, (6, 4)), *greys(2)[1:]]})
    frames = list(open_input(path, max_pixels=24).frames())
    assert 'at most 24 pixels (max_pixels), got 60 x 40' in frames[1].problem


def test_a_size_is_only_believed_of_as_many_bytes(tmp_path: Path) -> None:
    empty, short = greys(3)[1:]
    empty.height = empty.width = 8192
    empty.data = empty.data[:0]
    short.encoding = 'nonsense'
    path = write_bag2(tmp_path / 'raw', {'/c': [*greys(1), empty, short]})
    assert [frame.shape for frame in open_input(path).frames()] == [(40, 60), (0, 0), (40, 60)]


@pytest.mark.parametrize('bits', [12, 16])
def test_a_bag_of_some_of_16_bits_is_as_bright_as_others(bits: int, tmp_path: Path) -> None:
    messages = greys(3)
    for message, part in zip(messages, (1.0, 0.1, 0.5), strict=True):
        values = np.full((message.height, message.width), part * (2**bits - 1), np.uint16)
        message.encoding, message.step = 'mono16', 2 * message.width
        message.data = values.view(np.uint8).ravel()
    source = open_input(write_bag2(tmp_path / 'walk', {'/image': messages}))
    for _ in range(2):
        assert [int(image[0, 0, 0]) for image in source.images()] == [255, 25, 127]


@pytest.mark.parametrize('kind', WRITERS)
@pytest.mark.parametrize('name', ['12:30:05', 'walk%20#1?a=b'])
def test_the_name_of_a_bag_is_but_a_name(kind: str, name: str, tmp_path: Path) -> None:
    plain = WRITERS[kind](tmp_path / 'plain', {'/image': greys(3)})
    bag = plain.rename(tmp_path / f'{name}{plain.suffix}')
    assert numbers(open_input(bag)) == [0, 1, 2]
    if kind == 'sqlite3':
        alone = (bag / 'plain.db3').rename(tmp_path / f'{name}.db3')
        assert numbers(open_input(alone)) == [0, 1, 2]
