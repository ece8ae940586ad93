# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import os
import struct
from pathlib import Path

import cv2
import numpy as np
import pytest

from gait_segmentation.errors import SequenceError
from gait_segmentation.inputs import ImageSource, open_input
from gait_segmentation.inputs.film import _Times
from test.files.test_encoded_images import HUGE


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for index in range(5):
        cv2.imwrite(str(tmp_path / f'{index}.png'), np.full((40, 60, 3), 50 * index, np.uint8))
    (tmp_path / 'notes.txt').write_text('no image')
    return tmp_path


def greys(film: ImageSource) -> list[int]:
    return [int(image[20, 20, 0]) // 50 for image in film.images()]


def test_a_folder_is_read_in_the_order_of_names(folder: Path) -> None:
    film = open_input(str(folder))
    assert (film.size, film.scale, film.fps) == ((60, 40), 1.0, 30.0)
    assert greys(film) == [0, 1, 2, 3, 4]
    assert greys(film) == [0, 1, 2, 3, 4]


@pytest.mark.parametrize('address', ['rtsp://10.0.0.1/x', 'https://a.org/walk.mp4'])
def test_an_address_is_no_recording(address: str) -> None:
    with pytest.raises(SequenceError, match='is an address and no file: fetch the film, or'):
        open_input(Path(address))


@pytest.mark.parametrize('camera', ['0', '/dev/null'])
def test_a_camera_is_no_recording(camera: str, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SequenceError, match='is a camera and no recording: its driver'):
        open_input(Path(camera))


def test_a_name_that_is_no_text_is_refused() -> None:
    with pytest.raises(SequenceError, match='is not UTF-8: rename it'):
        open_input(Path('clip\udcff.mp4'))


def test_hidden_files_are_no_frames(folder: Path) -> None:
    (folder / '._0001.png').write_bytes(b'of another system')
    assert greys(open_input(folder)) == [0, 1, 2, 3, 4]


def test_the_rate_of_a_folder_can_be_told(folder: Path) -> None:
    stamps = [frame.stamp_ns for frame in open_input(folder, rate=8).frames()]
    assert stamps == [125_000_000 * (index + 1) for index in range(len(stamps))]
    assert open_input(folder, rate=8).fps == 8
    for wrong in (-1, float('nan'), 1e-300, 1e-3, 1e300, float('inf')):
        with pytest.raises(SequenceError, match=r'rate must be 0, or from 0\.01 to 1000 Hz'):
            open_input(folder, rate=wrong)


@pytest.mark.parametrize(
    ('given', 'allowed'),
    [
        ({'start': 10**21}, 'start must be from 0 to 2147483647'),
        ({'start': -1}, 'start must be from 0 to'),
        ({'count': 10**21}, 'count must be from 1 to'),
        ({'width': 10**9}, 'width must be from 0 to 65536'),
        ({'max_pixels': 10**30}, 'max_pixels must be from 1 to'),
    ],
)
def test_numbers_that_no_input_has_are_refused(folder: Path, given: dict, allowed: str) -> None:
    with pytest.raises(SequenceError, match=f'{allowed}.*, got {next(iter(given.values()))}$'):
        open_input(folder, **given)


def test_only_bags_have_topics(folder: Path) -> None:
    with pytest.raises(SequenceError, match='is no bag and has no topic /image: leave out'):
        open_input(folder, topic='/image')


def test_frames_are_scaled_down_and_never_up(folder: Path) -> None:
    film = open_input(folder, width=30)
    assert (film.size, film.scale) == ((30, 20), 0.5)
    assert next(film.images()).shape == (20, 30, 3)
    assert open_input(folder, width=600).size == (60, 40)


def test_nothing_is_scaled_down_to_nothing(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / '1.png'), np.zeros((1, 90, 3), np.uint8))
    film = open_input(tmp_path, width=9)
    assert film.size == (9, 1)
    assert [image.shape for image in film.images()] == [(1, 9, 3)]


def write_film(path: Path) -> Path:
    codec = int.from_bytes(b'mp4v', 'little')
    writer = cv2.VideoWriter(str(path), codec, 12.0, (64, 48))
    for index in range(5):
        writer.write(np.full((48, 64, 3), 10 + 50 * index, np.uint8))
    writer.release()
    return path


@pytest.mark.parametrize(
    'name',
    [
        '2024-05-01T12:30:05.mp4',
        'file:walk.mp4',
        'http:/walk.mp4',
        'walk%03d.mp4',
        '-walk.mp4',
        'a*?[1]{b} ä\n走.mp4',
    ],
)
def test_the_name_of_a_film_is_but_a_name(name: str, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path(name).parent.mkdir(exist_ok=True)
    write_film(tmp_path / 'film.mp4').rename(name)
    assert greys(open_input(name)) == [0, 1, 2, 3, 4]


def test_a_film_file_is_read(tmp_path: Path) -> None:
    path = write_film(tmp_path / 'film.mp4')
    film = open_input(path, start=2)
    assert film.fps == pytest.approx(12)
    assert greys(film) == [2, 3, 4]
    slower = [frame.stamp_ns for frame in open_input(path, rate=4).frames()]
    assert slower == [250_000_000 * (index + 1) for index in range(5)]


@pytest.mark.parametrize('degrees', [0, 90, 180, 270])
def test_a_film_of_a_telephone_is_upright(degrees: int, tmp_path: Path) -> None:
    path = tmp_path / 'film.mp4'
    codec = int.from_bytes(b'mp4v', 'little')
    upright = np.zeros((64, 96, 3), np.uint8)
    upright[:32, :48] = 255
    # As the sensor lies.
    lying = np.ascontiguousarray(np.rot90(upright, degrees // 90))
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
    for rotate in (0, 90, 180, 270):
        film = open_input(path, rotate=rotate, width=48)
        expected = np.rot90(upright, -rotate // 90)
        assert film.size == (48, round(48 * expected.shape[0] / expected.shape[1]))
        for image in film.images():
            scaled = cv2.resize(np.ascontiguousarray(expected), film.size)
            assert np.abs(image.astype(int) - scaled).mean() < 10


def test_frames_are_turned_clockwise(tmp_path: Path) -> None:
    picture = np.zeros((4, 6, 3), np.uint8)
    picture[0, 0] = 255
    cv2.imwrite(str(tmp_path / '0.png'), picture)
    (tmp_path / '1.png').write_bytes(b'broken')
    for rotate, corner in ((90, (0, 3)), (180, (3, 5)), (270, (5, 0))):
        (image,) = open_input(tmp_path, rotate=rotate).images()
        assert image[corner].all()
        assert image.sum() == 3 * 255
    for wrong in (45, -90, 360):
        with pytest.raises(SequenceError, match=f'rotate must be 0, 90, 180 or 270, got {wrong}'):
            open_input(tmp_path, rotate=wrong)


def test_stamps_are_of_the_rate_unless_the_film_says_otherwise() -> None:
    even = _Times(25.0)
    assert [even.stamp_ns(n, 40.0 * n + 3) for n in range(3)] == [
        40_000_000,
        80_000_000,
        120_000_000,
    ]
    # A container that claims the rate of half frames.
    halves = _Times(50.0)
    assert [halves.stamp_ns(n, 40.0 * (n + 1)) for n in range(3)] == [
        20_000_000,
        60_000_000,
        100_000_000,
    ]
    # Times that are missing or go back are not believed.
    none = _Times(25.0)
    assert [none.stamp_ns(n, 0.0) for n in range(4)] == [40_000_000 * (n + 1) for n in range(4)]


def test_what_cannot_be_used_is_an_error(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(SequenceError, match='does not exist'):
        open_input(tmp_path / 'nowhere')
    with pytest.raises(SequenceError, match='has no frame 9'):
        open_input(folder, start=9)
    with pytest.raises(SequenceError, match='count must be from 1 to 2147483647, got 0'):
        open_input(folder, count=0)
    with pytest.raises(SequenceError, match='cannot be read as a film'):
        open_input(folder / 'notes.txt')
    empty = tmp_path / 'empty'
    empty.mkdir()
    with pytest.raises(SequenceError, match='holds no images'):
        open_input(empty)


def test_the_number_of_frames_that_a_film_claims_is_a_hint(tmp_path: Path) -> None:
    path = tmp_path / 'film.avi'
    codec = int.from_bytes(b'MJPG', 'little')
    writer = cv2.VideoWriter(str(path), codec, 25.0, (64, 48))
    rng = np.random.default_rng(1)
    for _ in range(40):
        writer.write(rng.integers(0, 256, (48, 64, 3)).astype(np.uint8))
    writer.release()
    assert len(list(open_input(path).images())) == 40
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    film = open_input(path)
    assert film.total == 40
    assert 10 < len(list(film.frames())) < 30


def test_a_number_of_frames_beyond_all_films_is_unknown(tmp_path: Path) -> None:
    path = spoilt_film(tmp_path, {b'avih': 16, b'strh': 32})
    film = open_input(path)
    assert film.total is None
    assert len(list(film.frames())) == 5


@pytest.mark.parametrize('codec', [b'VP90', b'apcn', b'FFV1', b'RV40'])
def test_the_codec_of_a_film_that_cannot_be_decoded_is_said(codec: bytes, tmp_path: Path) -> None:
    path = spoilt_film(tmp_path, {})
    path.write_bytes(path.read_bytes().replace(b'MJPG', codec))
    with pytest.raises(SequenceError, match="no frame can be decoded; its codec is '"):
        open_input(path)


def spoilt_film(folder: Path, counts: dict[bytes, int]) -> Path:
    """Write a film whose counts of frames, at these places of its parts, are too large."""
    path = folder / 'film.avi'
    writer = cv2.VideoWriter(str(path), int.from_bytes(b'MJPG', 'little'), 25.0, (64, 48))
    for _ in range(5):
        writer.write(np.zeros((48, 64, 3), np.uint8))
    writer.release()
    data = bytearray(path.read_bytes())
    for part, place in counts.items():
        struct.pack_into('<I', data, data.index(part) + 8 + place, 2**32 - 16)
    path.write_bytes(data)
    return path


@pytest.mark.parametrize('name', ['walk.mp4', '0.png', 'walk.mcap', 'walk.db3', 'walk.bag'])
def test_a_pipe_is_no_input(name: str, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / name)
    with pytest.raises(SequenceError, match=f'{name} cannot be read: it is a pipe and no file'):
        open_input(tmp_path / name)


def test_an_image_that_cannot_be_read_is_one_frame_less(folder: Path) -> None:
    whole = len(list(open_input(folder).frames()))
    (folder / '2.png').write_bytes(b'broken')
    os.mkfifo(folder / '99.png')
    frames = list(open_input(folder).frames())
    assert len(frames) == whole + 1
    broken = [frame for frame in frames if frame.image is None]
    assert '2.png is not a complete image' in broken[0].problem
    assert '99.png cannot be read: it is a pipe' in broken[1].problem
    assert len(broken) == 2
    for path in folder.glob('*.png'):
        path.unlink()
        path.write_bytes(b'broken')
    with pytest.raises(SequenceError, match='no frame can be read; frame'):
        open_input(folder)


def test_frames_that_claim_too_many_pixels_are_refused(folder: Path, tmp_path: Path) -> None:
    film = tmp_path / 'film.avi'
    codec = int.from_bytes(b'MJPG', 'little')
    writer = cv2.VideoWriter(str(film), codec, 12.0, (64, 48))
    writer.write(np.zeros((48, 64, 3), np.uint8))
    writer.release()
    assert open_input(film, max_pixels=64 * 48).size == (64, 48)
    with pytest.raises(SequenceError, match=r'film\.avi: .* at most 3071 pixels .* 64 x 48'):
        open_input(film, max_pixels=64 * 48 - 1)
    with pytest.raises(SequenceError, match=r'\d\.png: .* at most 2399 pixels .* 60 x 40'):
        open_input(folder, max_pixels=2399)
    with pytest.raises(SequenceError, match='max_pixels must be from 1 to 1073741824, got 0'):
        open_input(folder, max_pixels=0)
    (folder / '7.png').write_bytes(HUGE['png of zeros'])
    with pytest.raises(SequenceError, match=r'7\.png: image must have at most'):
        open_input(folder / '7.png')


def test_a_folder_of_12_bits_is_as_bright_as_others(tmp_path: Path) -> None:
    for number, most in enumerate((4095, 40, 2000)):
        picture = np.full((40, 60), most, np.uint16)
        assert cv2.imwrite(str(tmp_path / f'{number}.png'), picture)
    source = open_input(tmp_path)
    # Each time from its beginning.
    for _ in range(2):
        assert [int(image[0, 0, 0]) for image in source.images()] == [255, 2, 125]
