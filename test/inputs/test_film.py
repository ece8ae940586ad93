# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from zlib import compress, crc32

import cv2
import numpy as np
import pytest

from gait_segmentation import encodings
from gait_segmentation.encodings import in_8_bits
from gait_segmentation.errors import SequenceError
from gait_segmentation.inputs import (
    DamagedError,
    ImageSource,
    film as film_module,
    open_input,
)
from test.inputs.test_folder import HUGE_PNG


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder of 5 images of 60 x 40 that tell their numbers: 50 times them."""
    path = tmp_path / 'images'
    path.mkdir()
    for index in range(5):
        image = np.full((40, 60, 3), 50 * index, np.uint8)
        assert cv2.imwrite(str(path / f'{index}.png'), image)
    return path


@pytest.fixture
def film(tmp_path: Path) -> Path:
    """Return a film of 5 frames of 64 x 48 at 12 Hz, as bright."""
    return write_film(tmp_path / 'film.mp4')


def write_film(path: Path, codec: bytes = b'mp4v', count: int = 5) -> Path:
    writer = cv2.VideoWriter(str(path), int.from_bytes(codec, 'little'), 12.0, (64, 48))
    for index in range(count):
        writer.write(np.full((48, 64, 3), 10 + 50 * (index % 5), np.uint8))
    writer.release()
    return path


def greys(source: ImageSource) -> list[int]:
    return [int(image[20, 20, 0]) // 50 for image in source.images()]


def test_a_folder_with_metadata_of_its_own_is_one_of_images_and_what_is_skipped_is_named(
    folder: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (folder / 'metadata.yaml').write_text('camera: mine\n')
    for name in ('5.raw', '6.raw'):
        (folder / name).write_bytes(b'II*\0')
    assert greys(open_input(folder)) == [0, 1, 2, 3, 4]
    (record,) = caplog.records
    assert str(folder) in record.getMessage()
    assert '2 .raw' in record.getMessage()


def test_the_rate_of_an_input_can_be_told(folder: Path, film: Path) -> None:
    for path in (folder, film):
        source = open_input(path, rate=8)
        assert source.fps == 8
        stamps = [frame.stamp_ns for frame in source.frames()]
        assert stamps == [125_000_000 * (index + 1) for index in range(5)]


def test_of_a_stream_without_times_it_is_said_that_its_rate_is_assumed(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / 'pi.mjpeg'
    path.write_bytes(cv2.imencode('.jpg', np.full((48, 64, 3), 90, np.uint8))[1].tobytes() * 5)
    assert (open_input(path, rate=20).fps, len(caplog.records)) == (20, 0)
    assert open_input(path).fps == 25
    assert 'has no times and is read at 25 frames per second' in caplog.text


def test_frames_are_scaled_down_and_never_up_or_to_nothing(folder: Path, tmp_path: Path) -> None:
    source = open_input(folder, width=30)
    assert (source.size, source.scale) == ((30, 20), 0.5)
    assert next(source.images()).shape == (20, 30, 3)
    assert open_input(folder, width=600).size == (60, 40)
    cv2.imwrite(str(tmp_path / '1.png'), np.zeros((1, 90, 3), np.uint8))
    assert open_input(tmp_path / '1.png', width=9).size == (9, 1)


def test_an_animated_png_is_a_film(tmp_path: Path) -> None:
    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack('>I', len(data)) + kind + data + struct.pack('>I', crc32(kind + data))

    size = struct.pack('>2I', 64, 48)
    parts = [chunk(b'IHDR', size + b'\x08\0\0\0\0'), chunk(b'acTL', struct.pack('>2I', 3, 0))]
    for index in range(3):
        pixels = compress(bytes([0, *[40 * index] * 64]) * 48)
        number = max(2 * index - 1, 0)
        about = size + struct.pack('>2I2H2B', 0, 0, 1, 8, 0, 0)
        parts.append(chunk(b'fcTL', struct.pack('>I', number) + about))
        data = struct.pack('>I', number + 1) + pixels
        parts.append(chunk(b'fdAT', data) if index else chunk(b'IDAT', pixels))
    path = tmp_path / 'walk.png'
    path.write_bytes(b'\x89PNG\r\n\x1a\n' + b''.join(parts) + chunk(b'IEND', b''))
    source = open_input(path)
    assert source.fps == 8
    assert [int(image[9, 9, 0]) for image in source.images()] == [0, 40, 80]


@pytest.mark.parametrize('name', ['2024-05-01T12:30:05.mp4', 'walk%03d.mp4', '-ä 走.mp4'])
def test_the_name_of_a_film_is_but_a_name(name: str, film: Path, monkeypatch) -> None:
    monkeypatch.chdir(film.parent)
    film.rename(name)
    assert greys(open_input(name)) == [0, 1, 2, 3, 4]


def test_a_film_is_read_at_its_rate(film: Path) -> None:
    source = open_input(film, start=2)
    assert source.fps == pytest.approx(12)
    assert greys(source) == [2, 3, 4]
    assert [frame.stamp_ns for frame in source.frames()] == [250000000, 333333333, 416666667]


@pytest.mark.parametrize(
    ('times', 'steps'),
    [
        ([0, 2, 4, 5, 6], [2, 2, 1, 1]),
        # Clocks that jump, and none.
        ([0, 6000, 2, 3, 6001], [6000, 0.0024, 0.0024, 1 - 0.0048]),
        ([None] * 5, [1, 1, 1, 1]),
    ],
)
def test_frames_have_the_times_of_a_film_and_go_on_where_these_jump(
    times: list[int | None], steps: list[float], film: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def retimed(container: Any) -> Iterator[Any]:
        for frame, time in zip(decoded(container), times, strict=True):
            frame.pts = None if time is None else round(time / 12 / frame.time_base)
            yield frame

    decoded = film_module._decoded
    monkeypatch.setattr(film_module, '_decoded', retimed)
    stamps = [frame.stamp_ns for frame in open_input(film).frames()]
    assert np.diff(stamps) * 12e-9 == pytest.approx(steps, rel=1e-6)


@pytest.mark.parametrize('degrees', [0, 90, 180, 270])
def test_a_film_of_a_telephone_is_upright(degrees: int, tmp_path: Path) -> None:
    path = tmp_path / 'film.mp4'
    upright = np.zeros((64, 96, 3), np.uint8)
    upright[:32, :48] = 255
    # As the sensor lies.
    lying = np.ascontiguousarray(np.rot90(upright, degrees // 90))
    codec = int.from_bytes(b'mp4v', 'little')
    writer = cv2.VideoWriter(str(path), codec, 12.0, lying.shape[1::-1])
    for _ in range(3):
        writer.write(lying)
    writer.release()
    data = bytearray(path.read_bytes())
    matrix = {0: (1, 0, 0, 1), 90: (0, 1, -1, 0), 180: (-1, 0, 0, -1), 270: (0, -1, 1, 0)}
    a, b, c, d = (value << 16 for value in matrix[degrees])
    numbers = (a, b, 0, c, d, 0, 0, 0, 1 << 30)
    struct.pack_into('>9i', data, data.index(b'tkhd') + 44, *numbers)
    path.write_bytes(data)
    for rotate in (0, 90):
        source = open_input(path, rotate=rotate, width=48)
        expected = np.rot90(upright, -rotate // 90)
        assert source.size == (48, round(48 * expected.shape[0] / expected.shape[1]))
        for image in source.images():
            scaled = cv2.resize(np.ascontiguousarray(expected), source.size)
            assert np.abs(image.astype(int) - scaled).mean() < 10


@pytest.mark.parametrize(
    ('name', 'codec'), [('film.avi', b'MJPG'), ('film.mp4', b'mp4v'), ('film.mkv', b'MJPG')]
)
def test_a_film_that_ends_early_is_damaged_and_all_before_is_read(
    name: str, codec: bytes, tmp_path: Path
) -> None:
    path = write_film(tmp_path / name, codec, 40)
    whole = path.read_bytes()
    assert len(list(open_input(path).frames())) == 40
    # Where it is cut off, or nothing but zeros; the index of an MP4 is behind.
    middle = len(whole) // 2
    rest = whole[middle:]
    zeros = (
        bytes(len(rest))
        if b'moov' not in rest
        else bytes(at := rest.index(b'moov') - 4) + rest[at:]
    )
    path.write_bytes(whole[:middle] + zeros)
    source, read = open_input(path), []
    assert source.total == 40
    with pytest.raises(DamagedError, match=r'is damaged: \d+ of about 40 frames can be read'):
        read.extend(frame for frame in source.frames())
    assert 0 < len(read) < 40


@pytest.mark.parametrize(('name', 'codec'), [('film.avi', b'MJPG'), ('film.mkv', b'MJPG')])
@pytest.mark.parametrize(('left', 'damaged'), [(0.6, True), (1.0, False)])
def test_a_film_that_was_cut_off_is_damaged(
    name: str, codec: bytes, left: float, damaged: bool, tmp_path: Path
) -> None:
    path = write_film(tmp_path / name, codec, 40)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(left * len(whole))])
    read, problem = [], ''
    try:
        read.extend(open_input(path).frames())
    except DamagedError as error:
        problem = str(error)
    assert ('of about 40 frames can be read' in problem) == damaged
    assert (0 < len(read) < 40) if damaged else (len(read) == 40)


def test_what_an_edit_list_hides_is_not_missing(tmp_path: Path) -> None:
    path = write_film(tmp_path / 'film.mp4', count=40)
    data = bytearray(path.read_bytes())
    at = data.index(b'elst') + 12
    struct.pack_into('>I', data, at, struct.unpack_from('>I', data, at)[0] // 8)
    path.write_bytes(data)
    assert 5 <= len(list(open_input(path).frames())) < 10


# Recordings may begin anywhere.
@pytest.mark.parametrize(('order', 'lost'), [([None, 0, 1], 0), ([0, None, 1], 1)])
def test_a_film_with_a_hole_is_damaged_and_the_rest_is_read(
    order: list[int | None], lost: int, film: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def spoilt(container: Any) -> Iterator[Any]:
        frames = list(decoded(container))
        yield from (None if each is None else frames[each] for each in order)

    decoded = film_module._decoded
    monkeypatch.setattr(film_module, '_decoded', spoilt)
    read, damaged = [], False
    try:
        read.extend(open_input(film).frames())
    except DamagedError:
        damaged = True
    assert (len(read), damaged) == (2, bool(lost))


@pytest.mark.parametrize(
    ('given', 'said'),
    [
        ({'start': -1}, 'start must be from 0 to'),
        ({'start': 9}, 'has no frame 9'),
        ({'count': 0}, 'count must be from 1 to'),
        ({'width': 10**9}, 'width must be from 0 to 65536'),
        ({'max_pixels': 2399}, 'at most 2399 pixels'),
        ({'rotate': 45}, 'rotate must be 0, 90, 180 or 270'),
        ({'rate': float('nan')}, 'rate must be 0, or from 0'),
        ({'topic': '/image'}, 'leave out --topic'),
    ],
)
def test_what_is_asked_for_and_cannot_be_is_refused(folder: Path, given: dict, said: str) -> None:
    with pytest.raises(SequenceError, match=said):
        open_input(folder, **given)


@pytest.mark.parametrize(
    ('name', 'said'),
    [
        ('nowhere', 'does not exist'),
        ('rtsp://10.0.0.1/x', 'is an address'),
        ('RTSP://10.0.0.1/x', 'is an address'),
        ('0', 'is a camera'),
        ('/dev/video97', 'is a camera'),
        ('notes.txt', 'cannot be read as a film'),
        ('empty', r'holds no images .* and no bag$'),
        ('films', r'and no bag: give each film or bag in it, such as films/\*'),
        ('nested', 'and no bag: images lie one folder down, in nested/b'),
        ('walk.mcap.zst', 'it is packed: unpack it first'),
        ('walk.bag.active', 'rosbag reindex FILE'),
        ('cut.mp4', 'the recording was cut off before it was finished'),
        ('unknown.avi', "its codec is '"),
        ('huge.png', 'OPENCV_IO_MAX_IMAGE_PIXELS'),
    ],
)
def test_what_is_no_input_is_refused(
    name: str, said: str, film: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(film.parent)
    Path('notes.txt').write_text('words')
    for name_of_folder in ('empty', 'films', 'nested/a', 'nested/b'):
        Path(name_of_folder).mkdir(parents=True)
    for file in ('films/a.mp4', 'nested/b/0.jfif', 'walk.mcap.zst', 'walk.bag.active'):
        Path(file).write_text('words')
    Path('huge.png').write_bytes(HUGE_PNG)
    Path('cut.mp4').write_bytes(film.read_bytes().partition(b'moov')[0])
    unknown = write_film(Path('unknown.avi'), b'MJPG')
    unknown.write_bytes(unknown.read_bytes().replace(b'MJPG', b'VP90'))
    with pytest.raises(SequenceError, match=said):
        open_input(Path(name))


def test_an_image_that_cannot_be_read_is_one_frame_less(folder: Path) -> None:
    (folder / '2.png').write_bytes(b'broken')
    frames = list(open_input(folder).frames())
    assert [frame.image is None for frame in frames] == [False, False, True, False, False]
    assert '2.png' in frames[2].problem
    for path in folder.glob('*.png'):
        path.write_bytes(b'broken')
    with pytest.raises(SequenceError, match='no frame can be read'):
        open_input(folder)


def test_of_16_bits_the_upper_8_used_count(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    encodings._warn_of_darkness.cache_clear()
    for number, most in enumerate((4095, 40, 65535)):
        assert cv2.imwrite(str(tmp_path / f'{number}.png'), np.full((4, 6), most, np.uint16))
    for bits, expected in ((16, [15, 0, 255]), (12, [255, 2, 255])):
        source = open_input(tmp_path, sample_bits=bits)
        assert [int(image[0, 0, 0]) for image in source.images()] == expected
        # Of each number of bits it is told once that one is as dark as if there were less.
        assert f'nearly black if {bits} of them' in caplog.records[-1].getMessage()
    assert len(caplog.records) == 2
    encodings._warn_of_darkness.cache_clear()
    in_8_bits(np.full((4, 6), 1024, np.uint16), '', 12)
    assert len(caplog.records) == 2
